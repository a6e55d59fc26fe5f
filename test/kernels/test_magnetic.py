"""Magnetic field in the body: gradient by differences, update by the information form."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import settings
import numpy as np
from oracles import conjugate
from oracles import covariance
from oracles import difference
from oracles import quaternions
from oracles import sandwich
from oracles import seeds
from oracles import vectors
import pytest

from ekf_fusion_ros.kernels.magnetic import correct_by_field
from ekf_fusion_ros.kernels.magnetic import field_jacobian
from ekf_fusion_ros.kernels.magnetic import fuse_field
from ekf_fusion_ros.kernels.magnetic import fuse_field_axis
from ekf_fusion_ros.kernels.magnetic import limit_field
from ekf_fusion_ros.kernels.magnetic import low_pass

NOISE = 0.05 ** 2
ALL_FREE = np.array((0.0, 0.0, 0.0, 1.0, 1.0, 1.0))


def field_in_body(x):
    return sandwich(conjugate(x[0:4]), x[16:19]) + x[19:22]


def state(q, earth, body):
    x = np.zeros(24)
    x[0:4], x[16:19], x[19:22] = q, earth, body
    return x


@settings(deadline=None, max_examples=40)
@given(q=quaternions(), earth=vectors(3, 0.6), body=vectors(3, 0.1))
def test_gradient_of_each_axis(q, earth, body):
    x, h = state(q, earth, body), np.full(24, np.nan)
    expected = difference(field_in_body, x, 1e-2)
    for axis in range(3):
        assert field_jacobian(x, axis, h) == pytest.approx(field_in_body(x)[axis], abs=1e-14)
        np.testing.assert_allclose(h, expected[axis], atol=1e-12)


@settings(deadline=None, max_examples=20)
@given(seed=seeds(), q=quaternions(), measured=vectors(3, 0.5))
def test_innovation_and_its_variance(seed, q, measured):
    x, p = state(q, np.array((0.2, 0.05, 0.43)), np.array((0.02, -0.01, 0.0))), covariance(seed)
    before, gate, measured = p.copy(), 3.0, measured + 1e6
    fit, innovation, variance, ratio, outcome = correct_by_field(
        x, p, measured, 3, NOISE, gate, True, 0.24, 1e-3, ALL_FREE)
    assert fit and outcome == (0, 0, 0)
    np.testing.assert_allclose(ratio, np.square(innovation) / (gate ** 2 * np.array(variance)),
                               rtol=1e-9)
    h = difference(field_in_body, x, 1e-2)
    np.testing.assert_allclose(innovation, field_in_body(x) - measured, rtol=1e-15)
    np.testing.assert_allclose(variance, np.diag(h @ p @ h.T) + NOISE, rtol=1e-9)
    np.testing.assert_array_equal(p, before)


def test_an_axis_whose_variance_is_below_the_noise_spoils_all():
    x = state(np.array((1.0, 0.0, 0.0, 0.0)), np.array((0.2, 0.05, 0.43)), np.zeros(3))
    p = 0.01 * np.eye(24)
    p[20, 20] = -1.0
    measured, before, p_before = field_in_body(x), x.copy(), p.copy()
    fit, _, variance, _, outcome = correct_by_field(
        x, p, measured, 3, NOISE, 3.0, True, 0.24, 1e-3, ALL_FREE)
    assert not fit and [bool(fault) for fault in outcome] == [False, True, False]
    assert variance[1] < NOISE < variance[0]
    np.testing.assert_array_equal(x, before)
    np.testing.assert_array_equal(p, p_before)


@pytest.mark.parametrize('axes', [2, 3])
def test_one_bad_axis_that_counts_rejects_all(axes):
    x = state(np.array((1.0, 0.0, 0.0, 0.0)), np.array((0.2, 0.05, 0.43)), np.zeros(3))
    p = 1e-6 * np.eye(24)
    measured, before = field_in_body(x) + np.array((0.01, 0.0, 5.0)), x.copy()
    _, innovation, _, ratio, _ = correct_by_field(
        x, p, measured, axes, NOISE, 3.0, True, 0.24, 1e-3, ALL_FREE)
    if axes == 3:
        assert ratio[2] > 1.0
        np.testing.assert_array_equal(x, before)
    else:
        assert innovation[2] == ratio[2] == 0.0
        assert x[16] > before[16]


@pytest.mark.parametrize('axis', [0, 1, 2])
def test_update_is_that_of_the_information_form(axis):
    x = state(np.array((0.5, 0.1, -0.3, 0.8)) / np.linalg.norm((0.5, 0.1, -0.3, 0.8)),
              np.array((0.2, 0.05, 0.43)), np.array((0.02, -0.01, 0.0)))
    p, before, variance = covariance(11), x.copy(), np.zeros(3)
    h = difference(field_in_body, x, 1e-2)[axis]
    expected = np.linalg.inv(np.linalg.inv(p) + np.outer(h, h) / NOISE)
    gain = expected @ h / NOISE
    out = p.copy()
    assert fuse_field_axis(x, out, axis, 0.03, NOISE, True, ALL_FREE, variance) == 0
    np.testing.assert_allclose(out, expected, rtol=1e-6, atol=1e-10)
    moved = before - 0.03 * gain
    moved[0:4] /= np.linalg.norm(moved[0:4])
    np.testing.assert_allclose(x, moved, atol=1e-10)
    assert variance[axis] == pytest.approx(h @ p @ h + NOISE)


def test_young_field_states_take_all_of_the_correction():
    x = state(np.array((1.0, 0.0, 0.0, 0.0)), np.array((0.2, 0.0, 0.43)), np.zeros(3))
    before = x.copy()
    fuse_field_axis(x, covariance(5), 0, 0.03, NOISE, False, ALL_FREE, np.zeros(3))
    np.testing.assert_allclose(x[0:16], before[0:16], atol=1e-15)
    np.testing.assert_array_equal(x[22:24], before[22:24])
    assert abs(x[16] - before[16]) > 1e-4


@pytest.mark.parametrize('axes', [1, 2, 3])
def test_axes_in_sequence_are_one_vector_observation(axes):
    q = np.array((0.5, 0.1, -0.3, 0.8))
    x = state(q / np.linalg.norm(q), np.array((0.2, 0.05, 0.43)), np.array((0.02, -0.01, 0.0)))
    p, before = covariance(11), x.copy()
    h = difference(field_in_body, x, 1e-2)[0:axes]
    expected = np.linalg.inv(np.linalg.inv(p) + h.T @ h / NOISE)
    out = p.copy()
    # Nothing was wrong, so that all axes are fused about the same state.
    outcome = fuse_field(x, out, np.zeros(3), axes, NOISE, True, 0.24, 1e-3, ALL_FREE,
                         np.zeros(3))
    np.testing.assert_allclose(out, expected, rtol=1e-6, atol=1e-10)
    np.testing.assert_allclose(x, before, atol=1e-12)
    assert outcome == (0, 0, 0)


@pytest.mark.parametrize(('north', 'east', 'length', 'angle'), [
    (0.2, 0.05, math.hypot(0.2, 0.05), math.atan2(0.05, 0.2)),
    (0.2, 0.4, math.hypot(0.2, 0.4), 0.1 + 0.5),
    (0.2, -0.4, math.hypot(0.2, 0.4), 0.1 - 0.5),
    (0.03, 0.01, 0.1, math.atan2(0.01, 0.03)),
    (1e-6, -1e-6, 0.2, 0.1),
], ids=['sound', 'too far east', 'too far west', 'too short', 'vanished'])
def test_limits_of_the_earth_field(north, east, length, angle):
    x = np.full(24, 7.0)
    x[16:18] = north, east
    limit_field(x, 0.1, 0.1)
    np.testing.assert_allclose(x[16:18], (length * math.cos(angle), length * math.sin(angle)))
    assert np.count_nonzero(x == 7.0) == 22


@pytest.mark.parametrize(('steps', 'reached'), [(9, 0.63), (27, 0.95), (45, 0.99)])
def test_low_pass_rises_as_a_first_order_lag(steps, reached):
    """A share of a tenth is a time constant of nine and a half steps: 1, 3 and 5 of them."""
    value, target = np.zeros(3), np.array((1.0, -2.0, 0.5))
    distance = []
    for _ in range(steps):
        low_pass(value, target, 0.1)
        distance.append(np.abs(target - value))
    np.testing.assert_allclose(value / target, reached, atol=0.02)
    assert (np.diff(distance, axis=0) < 0.0).all()


@pytest.mark.parametrize(('share', 'expected'), [(0.0, 0.3), (1.0, -4.0)])
def test_low_pass_at_its_ends_holds_or_passes_through(share, expected):
    value = np.full(3, 0.3)
    low_pass(value, np.full(3, -4.0), share)
    np.testing.assert_array_equal(value, expected)


def test_low_pass_goes_to_one_and_from_there_to_minus_a_hundred():
    value = np.zeros(3)
    for goal, steps, within in ((1.0, 60, 0.01), (-100.0, 100, 0.01)):
        before = value.copy()
        for _ in range(steps):
            low_pass(value, np.full(3, goal), 0.1)
            assert (np.abs(goal - value) < np.abs(goal - before)).all()
            before = value.copy()
        np.testing.assert_allclose(value, goal, atol=within)


def test_low_pass_of_zero_stays_zero():
    value = np.zeros(3)
    low_pass(value, np.zeros(3), 0.1)
    np.testing.assert_array_equal(value, 0.0)
