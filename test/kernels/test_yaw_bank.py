"""The bank of yaw filters against a dense Kalman filter and scipy's normal density."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import settings
import numpy as np
from oracles import covariance
from oracles import difference
from oracles import seeds
from oracles import vectors
import pytest

from ekf_fusion_ros.kernels.yaw_bank import combine_models
from ekf_fusion_ros.kernels.yaw_bank import correct_models
from ekf_fusion_ros.kernels.yaw_bank import predict_attitudes
from ekf_fusion_ros.kernels.yaw_bank import predict_models

SCALES = np.array((0.4, 0.5, 0.3))
FEW = settings(deadline=None, max_examples=25)
DT = 0.01


def about_down(yaw):
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


def tilt(roll, pitch):
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    return rotation.from_euler('YX', (pitch, roll)).as_matrix()


@FEW
@given(seed=seeds(), lean=vectors(2, 0.6), increment=vectors(3, 0.5), start=vectors(3, 3.0))
def test_prediction_is_f_p_f_plus_noise(seed, lean, increment, start):
    level = tilt(*lean)

    def process(s):
        return np.concatenate([s[0:2] + (about_down(s[2]) @ level @ increment)[0:2], s[2:3]])

    rot = (about_down(start[2]) @ level)[np.newaxis].copy()
    state, cov = start[np.newaxis].copy(), covariance(seed, SCALES)
    f = difference(process, start)
    expected = f @ cov @ f.T + np.diag(((2.0 * DT) ** 2, (2.0 * DT) ** 2, (0.1 * DT) ** 2))
    out = cov[np.newaxis].copy()
    predict_models(rot, state, out, np.concatenate([np.zeros(3), increment, [DT, DT]]))
    np.testing.assert_allclose(out[0], expected, atol=1e-9)
    np.testing.assert_allclose(state[0, 0:2], process(start)[0:2], atol=1e-12)
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    sequence = 'ZYX' if abs(rot[0, 2, 0]) < abs(rot[0, 2, 1]) else 'ZXY'
    yaw = rotation.from_matrix(rot[0]).as_euler(sequence)[0]
    assert state[0, 2] == pytest.approx(yaw, abs=1e-9)


@FEW
@given(seed=seeds(), offset=vectors(2, 1.0))
def test_correction_is_that_of_a_kalman_filter(seed, offset):
    stats = pytest.importorskip('scipy.stats')
    accuracy = 0.3
    start, cov = np.array((3.0, -1.0, 0.4)), covariance(seed, SCALES)
    h = np.eye(2, 3)
    s = h @ cov @ h.T + accuracy ** 2 * np.eye(2)
    expected_cov = np.linalg.inv(np.linalg.inv(cov) + h.T @ h / accuracy ** 2)
    distance = math.sqrt(offset @ np.linalg.inv(s) @ offset)
    change = -cov @ h.T @ np.linalg.inv(s) @ offset * min(1.0, 5.0 / max(distance, 1e-9))

    rot = about_down(0.4)[np.newaxis].copy()
    state, out, density = start[np.newaxis].copy(), cov[np.newaxis].copy(), np.zeros(1)
    assert correct_models(rot, state, out, start[0:2] - offset, accuracy, density)
    np.testing.assert_allclose(out[0], expected_cov, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(state[0], start + change, atol=1e-10)
    np.testing.assert_allclose(rot[0], about_down(0.4 + change[2]), atol=1e-10)
    assert density[0] == pytest.approx(
        stats.multivariate_normal(np.zeros(2), s).pdf(offset), rel=1e-9)


def test_an_outlier_counts_as_five_sigma():
    cov = np.diag((0.09, 0.09, 0.01))
    cov[0, 2] = cov[2, 0] = 0.01
    state, rot = np.zeros((1, 3)), np.eye(3)[np.newaxis].copy()
    out = cov[np.newaxis].copy()
    correct_models(rot, state, out, np.array((100.0, 0.0)), 0.4, np.zeros(1))
    # S = 0.25, so that 100 m/s are 200 sigma; five of them are 2.5 m/s.
    np.testing.assert_allclose(state[0], (0.36 * 2.5, 0.0, 0.04 * 2.5))


def test_yaw_of_the_sum_is_a_circular_mean():
    yaw = np.radians((170.0, -170.0, 175.0))
    state = np.column_stack([np.zeros((3, 2)), yaw])
    cov = np.tile(np.diag((1.0, 1.0, 0.01)), (3, 1, 1))
    found, variance = combine_models(state, cov, np.array((0.5, 0.5, 0.0)))
    assert abs(found) == pytest.approx(math.pi)
    assert variance == pytest.approx(0.01 + math.radians(10.0) ** 2)


def test_attitudes_turn_with_the_gyros():
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    rate = np.array((0.4, -0.3, 0.8))
    rot = np.tile(np.eye(3), (5, 1, 1))
    imu = np.concatenate([rate * 1e-3, np.zeros(3), [1e-3, 1e-3]])
    for _ in range(2000):
        predict_attitudes(rot, np.zeros((5, 3)), imu, np.array((0.0, 0.0, -9.81)), 0.0, 0.0)
    expected = rotation.from_rotvec(2.0 * rate).as_matrix()
    for model in rot:
        np.testing.assert_allclose(model, expected, atol=2e-3)
        np.testing.assert_allclose(np.linalg.norm(model, axis=1), 1.0, atol=1e-9)


def test_attitudes_lean_towards_gravity():
    rot = np.tile(tilt(0.2, -0.1), (5, 1, 1))
    imu = np.concatenate([np.zeros(6), [DT, DT]])
    for _ in range(3000):
        predict_attitudes(rot, np.zeros((5, 3)), imu, np.array((0.0, 0.0, -9.81)), 0.2, 0.0)
    np.testing.assert_allclose(rot[:, 2, 2], 1.0, atol=1e-3)
