"""Acceleration, wind and ground as messages carry them."""

from __future__ import annotations

import math

from messages.test_encode import random_nav
import numpy as np
import pytest

from ekf_fusion_ros.messages.encode_surroundings import encode_acceleration
from ekf_fusion_ros.messages.encode_surroundings import encode_ground
from ekf_fusion_ros.messages.encode_surroundings import encode_wind


def looking_east(**fields):
    """A level vehicle whose nose points east."""
    half = math.sqrt(0.5)
    return random_nav(1)._replace(quaternion=np.array([half, 0.0, 0.0, half]), **fields)


def test_acceleration_is_that_of_the_body():
    nav = looking_east(acceleration=np.array([1.0, 2.0, -3.0]))
    fields = encode_acceleration(nav, 0.4)
    # east is forward, north is left, up is up
    assert fields.linear == pytest.approx((2.0, 1.0, 3.0))
    np.testing.assert_allclose(np.diag(fields.covariance.reshape(6, 6)), [0.16] * 3 + [0.0] * 3)
    assert fields.time_us == nav.time_us


def test_wind_goes_east_and_north():
    nav = looking_east(wind=np.array([3.0, -4.0]), wind_cov=np.array([[1.0, 0.2], [0.2, 9.0]]))
    fields = encode_wind(nav)
    assert fields.linear == (-4.0, 3.0, 0.0)
    np.testing.assert_array_equal(
        fields.covariance.reshape(6, 6)[0:2, 0:2], [[9.0, 0.2], [0.2, 1.0]])


def test_the_ground_is_below_the_vehicle():
    nav = looking_east(ground_down=2.5)
    north, east, _ = nav.position
    assert encode_ground(nav) == pytest.approx((east, north, -2.5))


def test_what_is_not_estimated_is_not_told():
    nav = looking_east()
    assert encode_acceleration(nav, 0.4) is encode_wind(nav) is encode_ground(nav) is None
