"""Prediction: F against differences, P against dense algebra, the state against physics."""

from __future__ import annotations

from hypothesis import given
from hypothesis import settings
import numpy as np
from oracles import covariance
from oracles import difference
from oracles import hamilton
from oracles import quaternions
from oracles import seeds
from oracles import to_scipy
from oracles import vectors
import pytest

from ekf_fusion_ros.kernels.prediction import fill_transition
from ekf_fusion_ros.kernels.prediction import limit_state
from ekf_fusion_ros.kernels.prediction import predict_covariance
from ekf_fusion_ros.kernels.prediction import predict_state

DT = 0.01
STEP = 0.01
"""The process is quadratic in every variable: central differences are exact."""

ANGLE_VAR = 1.5e-4 ** 2
VELOCITY_VAR = np.array((3.5e-3, 4.9e-2, 1e-2)) ** 2
FORTY = settings(deadline=None, max_examples=40)
NOISE = np.concatenate([np.zeros(7), np.full(3, 1e-5), np.full(3, 1e-14), np.full(3, 1e-12),
                        np.full(3, 1e-10), np.full(3, 1e-12), np.full(2, 1e-6)])


def rotate_unit_form(q, v):
    """R(q) v with the diagonal 1 - 2(..)."""
    w, x, y, z = q
    return np.array((
        (1 - 2 * (y * y + z * z)) * v[0] + 2 * (x * y - w * z) * v[1] + 2 * (x * z + w * y) * v[2],
        2 * (x * y + w * z) * v[0] + (1 - 2 * (x * x + z * z)) * v[1] + 2 * (y * z - w * x) * v[2],
        2 * (x * z - w * y) * v[0] + 2 * (y * z + w * x) * v[1] + (1 - 2 * (x * x + y * y)) * v[2],
    ))


def process(x, imu):
    """The process model of the covariance: small angles, nominal period."""
    step = np.concatenate([[1.0], 0.5 * (imu[0:3] - x[10:13])])
    increment = rotate_unit_form(x[0:4], imu[3:6] - x[13:16])
    return np.concatenate([hamilton(x[0:4], step), x[4:7] + increment, x[7:10] + x[4:7] * DT,
                           x[10:24]])


def drawn_state(q, bias):
    x = np.zeros(24)
    x[0:4] = q
    x[4:10] = (3.0, -2.0, 0.5, 10.0, 20.0, -5.0)
    x[10:13] = 1e-3 * bias
    x[13:16] = 3e-3 * bias[::-1]
    return x


def increments(angle, velocity):
    return np.concatenate([angle, velocity, [DT, DT]])


DRAWS = {'q': quaternions(), 'bias': vectors(3, 1.0), 'angle': vectors(3, 0.1),
         'velocity': vectors(3, 0.5)}


@FORTY
@given(**DRAWS)
def test_transition_is_the_derivative_of_the_process(q, bias, angle, velocity):
    x, imu = drawn_state(q, bias), increments(angle, velocity)
    f = np.zeros((10, 24))
    fill_transition(x[0:4], imu[0:3] - x[10:13], imu[3:6] - x[13:16], DT, f)
    expected = difference(lambda s: process(s, imu), x, STEP)[0:10]
    np.testing.assert_allclose(f, expected, atol=1e-9)


def dense_prediction(p, x, imu):
    f = difference(lambda s: process(s, imu), x, STEP)
    g = difference(lambda u: process(x, np.concatenate([u, imu[6:8]])), imu[0:6],
                   STEP)
    q = np.diag(np.concatenate([np.full(3, ANGLE_VAR), VELOCITY_VAR]))
    return f @ p @ f.T + g @ q @ g.T


def predicted(p, x, imu, inhibited=(0.0, 0.0, 0.0), saved=(0.0, 0.0, 0.0), mag=True, wind=True):
    out = p.copy()
    predict_covariance(out, np.zeros((10, 24)), x, imu, ANGLE_VAR, VELOCITY_VAR, NOISE,
                       np.array((*inhibited, mag, wind, 1.0), dtype=float), np.array(saved))
    return out


@settings(deadline=None, max_examples=12)
@given(seed=seeds(), **DRAWS)
def test_covariance_is_f_p_f_plus_noise(seed, q, bias, angle, velocity):
    x, imu, p = drawn_state(q, bias), increments(angle, velocity), covariance(seed)
    expected = dense_prediction(p, x, imu) + np.diag(NOISE)
    np.testing.assert_allclose(predicted(p, x, imu), expected, rtol=1e-9, atol=1e-11)


@pytest.fixture
def level():
    """A state, increments and a covariance away from any limit."""
    return drawn_state(np.array((0.8, 0.0, 0.0, 0.6)), np.ones(3)), increments(
        np.array((0.01, -0.02, 0.03)), np.array((0.05, -0.02, -0.098))), covariance(3)


def test_field_and_wind_drift_only_until_learned(level):
    x, imu, p = level
    for states, limit in ((slice(16, 19), 0.1), (slice(19, 22), 0.1), (slice(22, 24), 1.0)):
        unknown = p.copy()
        scale = np.ones(24)
        scale[states] = np.sqrt(1.1 * limit / np.trace(p[states, states]))
        unknown *= np.outer(scale, scale)
        expected = dense_prediction(unknown, x, imu) + np.diag(NOISE)
        expected[states, states] -= np.diag(NOISE[states])
        np.testing.assert_allclose(predicted(unknown, x, imu), expected, rtol=1e-9, atol=1e-11)


def test_a_bias_that_is_not_learned_keeps_its_variance(level):
    x, imu, p = level
    p[14, 0:16] = p[0:16, 14] = 0.0
    p[14, 14] = 7e-6
    out = predicted(p, x, imu, inhibited=(0.0, 1.0, 0.0), saved=(0.0, 7e-6, 0.0))
    assert out[14, 14] == 7e-6
    assert not out[14, [*range(14), 15]].any()
    rest = [i for i in range(24) if i != 14]
    expected = dense_prediction(p, x, imu) + np.diag(NOISE)
    inside = [i for i in rest if not 4 <= i < 10]
    np.testing.assert_allclose(out[np.ix_(inside, inside)], expected[np.ix_(inside, inside)],
                               rtol=1e-9, atol=1e-11)


def test_a_lost_position_is_not_propagated(level):
    x, imu, p = level
    scale = np.ones(24)
    scale[7:9] = 80.0
    p *= np.outer(scale, scale)
    assert p[7, 7] + p[8, 8] > 1e4
    out = predicted(p, x, imu)
    np.testing.assert_array_equal(out[7:9, 0:7], p[7:9, 0:7])
    np.testing.assert_allclose(out[9, 9], (dense_prediction(p, x, imu) + np.diag(NOISE))[9, 9])


@FORTY
@given(q=quaternions(), angle=vectors(3, 0.5), bias=vectors(3, 1e-3))
def test_attitude_turns_by_the_increment(q, angle, bias):
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    x, rot = np.zeros(24), rotation.from_quat(to_scipy(q)).as_matrix()
    x[0:4], x[10:13] = q, bias
    expected = rot @ rotation.from_rotvec(angle - bias).as_matrix()
    predict_state(x, rot, increments(angle, np.zeros(3)), np.zeros(3), np.zeros(2))
    np.testing.assert_allclose(rot, expected, atol=1e-9)
    np.testing.assert_allclose(rotation.from_quat(to_scipy(x[0:4])).as_matrix(), rot, atol=1e-12)


@FORTY
@given(q=quaternions())
def test_at_rest_on_a_turning_earth_nothing_moves(q):
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    rot = rotation.from_quat(to_scipy(q)).as_matrix()
    earth_rate = np.array((5e-5, 0.0, -5e-5))
    x = np.zeros(24)
    x[0:4] = q
    imu = increments(rot.T @ earth_rate * DT, rot.T @ np.array((0.0, 0.0, -9.80665)) * DT)
    for _ in range(100):
        predict_state(x, rot, imu, earth_rate, np.zeros(2))
    np.testing.assert_allclose(x[0:4], q, atol=1e-9)
    np.testing.assert_allclose(x[4:10], 0.0, atol=1e-9)


def test_free_fall():
    x, rot = np.zeros(24), np.eye(3)
    x[0], x[4] = 1.0, 2.0
    for _ in range(200):
        predict_state(x, rot, increments(np.zeros(3), np.zeros(3)), np.zeros(3), np.zeros(2))
    np.testing.assert_allclose(x[4:10], (2.0, 0.0, 2.0 * 9.80665, 4.0, 0.0, 2.0 * 9.80665))


def test_limits_of_the_state():
    x = np.full(24, 2e6)
    limit_state(x, 0.01, 0.4)
    limits = (1.0, 1e3, 1e6, np.radians(20.0) * 0.01, 0.004, 1.0, 0.5, 100.0)
    np.testing.assert_allclose(x, np.repeat(limits, (4, 3, 3, 3, 3, 3, 3, 2)))
    x = -x
    kept = x.copy()
    limit_state(x, 0.01, 0.4)
    np.testing.assert_array_equal(x, kept)
