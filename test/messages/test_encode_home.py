"""Home in ENU."""

from __future__ import annotations

import math

import pytest

from ekf_fusion_ros.health.home import Home
from ekf_fusion_ros.messages.encode_home import encode_home


def test_axes_and_heading():
    """3 m north, 4 m east, 5 m up; facing north-east, which is 45 deg from east as well."""
    fields = encode_home(Home(7, 47.0, 8.0, 400.0, 3.0, 4.0, -5.0, math.radians(45.0)))
    assert fields.position == (4.0, 3.0, 5.0)
    assert fields.yaw == pytest.approx(math.radians(45.0))
    assert fields.orientation == pytest.approx((0.0, 0.0, math.sin(math.pi / 8),
                                                math.cos(math.pi / 8)))
    assert encode_home(Home(7, 47.0, 8.0, 400.0, 0.0, 0.0, 0.0, 0.0)).yaw == pytest.approx(
        math.radians(90.0))


def test_without_a_map_frame():
    nan = math.nan
    fields = encode_home(Home(7, 47.0, 8.0, 400.0, nan, nan, nan, nan, manual=True))
    assert math.isnan(fields.position[0])
    assert fields.orientation == (0.0, 0.0, 0.0, 1.0)
    assert (fields.latitude, fields.longitude, fields.altitude) == (47.0, 8.0, 400.0)
