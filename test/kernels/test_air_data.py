"""Airspeed, sideslip and drag: predictions from first principles, gradients by differences."""

from __future__ import annotations

import math

from hypothesis import assume
from hypothesis import given
from hypothesis import settings
from hypothesis import strategies as st
import numpy as np
from oracles import conjugate
from oracles import difference
from oracles import quaternions
from oracles import sandwich
from oracles import vectors
import pytest

from ekf_fusion_ros.kernels.air_data import observe_airspeed
from ekf_fusion_ros.kernels.air_data import observe_sideslip
from ekf_fusion_ros.kernels.air_data import predict_drag
from ekf_fusion_ros.kernels.air_data import relative_wind

MANY = settings(deadline=None, max_examples=40)
DENSITY = 1.225


def state(q, velocity, wind):
    x = np.zeros(24)
    x[0:4], x[4:7], x[22:24] = q, velocity, wind
    return x


def against_air(x):
    return x[4:7] - np.array((x[22], x[23], 0.0))


def air_in_body(x):
    return sandwich(conjugate(x[0:4]), against_air(x))


@MANY
@given(q=quaternions(), velocity=vectors(3, 30.0), wind=vectors(2, 10.0))
def test_airspeed(q, velocity, wind):
    x, h = state(q, velocity, wind), np.full(24, np.nan)
    assume(np.linalg.norm(against_air(x)) > 1.0)
    assert observe_airspeed(x, h) == pytest.approx(np.linalg.norm(against_air(x)))
    np.testing.assert_allclose(
        h, difference(lambda x: np.linalg.norm(against_air(x)), x)[0], atol=1e-8)


def test_airspeed_of_nothing_has_no_gradient():
    h = np.full(24, np.nan)
    assert observe_airspeed(state((1.0, 0.0, 0.0, 0.0), (2.0, 1.0, 0.0), (2.0, 1.0)), h) == 0.0
    assert not h.any()


@MANY
@given(q=quaternions(), velocity=vectors(3, 30.0), wind=vectors(2, 10.0))
def test_relative_wind(q, velocity, wind):
    x = state(q, velocity, wind)
    air, jacobian = np.empty(3), np.full((3, 24), np.nan)
    relative_wind(x, air, jacobian)
    np.testing.assert_allclose(air, air_in_body(x), atol=1e-12)
    np.testing.assert_allclose(jacobian, difference(air_in_body, x, 1e-2), atol=1e-10)


@MANY
@given(q=quaternions(), velocity=vectors(3, 30.0), wind=vectors(2, 10.0))
def test_sideslip(q, velocity, wind):
    x = state(q, velocity, wind)
    assume(abs(air_in_body(x)[0]) > 3.0)
    air, jacobian, h = np.empty(3), np.empty((3, 24)), np.full(24, np.nan)
    relative_wind(x, air, jacobian)
    expected = air_in_body(x)
    assert observe_sideslip(air, jacobian, h) == pytest.approx(expected[1] / expected[0])
    slip = difference(lambda x: air_in_body(x)[1] / air_in_body(x)[0], x)
    np.testing.assert_allclose(h, slip[0], rtol=1e-6, atol=1e-6)


def test_sideslip_of_nothing_is_not_a_number():
    assert math.isnan(observe_sideslip(np.zeros(3), np.zeros((3, 24)), np.zeros(24)))


@MANY
@given(speed=st.floats(-25.0, 25.0), ballistic=st.sampled_from([0.0, 20.0, 80.0]),
       momentum=st.sampled_from([0.0, 0.15]))
def test_drag_opposes_the_motion_and_is_linearised_where_it_was_measured(
        speed, ballistic, momentum):
    assume(ballistic or momentum)

    def force(v):
        bluff = 0.5 * DENSITY * v * abs(v) / ballistic if ballistic else 0.0
        return -bluff - momentum * v

    out = np.empty(2)
    predict_drag(speed, force(speed), DENSITY, ballistic, momentum, out)
    assert out[0] == pytest.approx(force(speed), abs=1e-12)
    slope = -(force(speed + 1e-4) - force(speed - 1e-4)) / 2e-4
    assert out[1] == pytest.approx(max(slope, 0.1), rel=1e-4)
