"""Prediction and correction of LPE against a textbook Kalman filter written out here."""

from __future__ import annotations

import numpy as np
import pytest

from ekf_fusion_ros.lpe import correction
from ekf_fusion_ros.lpe.correction import Measurement
from ekf_fusion_ros.lpe.correction import corrected
from ekf_fusion_ros.lpe.correction import innovation_of
from ekf_fusion_ros.lpe.prediction import BIAS_MAX
from ekf_fusion_ros.lpe.prediction import VARIANCE_MAX
from ekf_fusion_ros.lpe.prediction import dynamics_matrix
from ekf_fusion_ros.lpe.prediction import initial_covariance
from ekf_fusion_ros.lpe.prediction import input_matrix
from ekf_fusion_ros.lpe.prediction import is_sound
from ekf_fusion_ros.lpe.prediction import noise_intensity
from ekf_fusion_ros.lpe.prediction import predicted_covariance
from ekf_fusion_ros.lpe.prediction import predicted_state
from ekf_fusion_ros.lpe.validity import Validity
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import quat_from_rotation_vector
from ekf_fusion_ros.params.lpe import ProcessParams

PARAMS = ProcessParams()


def everything_valid():
    valid = Validity()
    valid.horizontal = valid.height = valid.terrain = True
    return valid


class Textbook:
    """x' = A x + u in velocity, element by element, without matrices of the code under test."""

    def __init__(self):
        self.x = [0.0] * 10
        self.P = [[0.0] * 10 for _ in range(10)]
        for i, variance in enumerate([8.0] * 3 + [2 * 0.3 ** 2] * 3 + [1e-6] * 3 + [8.0]):
            self.P[i][i] = variance

    @staticmethod
    def model(rot):
        A = [[0.0] * 10 for _ in range(10)]
        for i in range(3):
            A[i][3 + i] = 1.0
            for j in range(3):
                A[3 + i][6 + j] = -float(rot[i][j])
        return A

    def predict(self, rot, u, dt):
        A = self.model(rot)
        accelerations = [
            u[i] - sum(float(rot[i][j]) * self.x[6 + j] for j in range(3)) for i in range(3)]
        speed = (self.x[3] ** 2 + self.x[4] ** 2) ** 0.5
        for i in range(3):
            # Exact for a constant acceleration.
            self.x[i] += dt * self.x[3 + i] + 0.5 * dt * dt * accelerations[i]
            self.x[3 + i] += dt * accelerations[i]
        q = [0.1 ** 2] * 3 + [0.1 ** 2 + 0.012 ** 2] * 2 + [0.1 ** 2 + 0.02 ** 2]
        q += [1e-3 ** 2] * 3 + [(1e-3 + 0.01 * speed) ** 2]
        P, n = self.P, range(10)
        change = [[sum(A[i][k] * P[k][j] + P[i][k] * A[j][k] for k in n) for j in n] for i in n]
        for i in n:
            change[i][i] += q[i]
        self.P = [[P[i][j] + dt * change[i][j] for j in n] for i in n]

    def correct(self, index, sign, y, r):
        """A scalar measurement y = sign x[index]."""
        s = self.P[index][index] + r
        gain = [sign * self.P[i][index] / s for i in range(10)]
        residual = y - sign * self.x[index]
        row = [sign * self.P[index][j] for j in range(10)]
        self.x = [x + k * residual for x, k in zip(self.x, gain, strict=True)]
        self.P = [[self.P[i][j] - gain[i] * row[j] for j in range(10)] for i in range(10)]
        return residual, s


def test_agrees_with_the_textbook_filter():
    rng = np.random.default_rng(4)
    book, x, P = Textbook(), np.zeros(10), initial_covariance(PARAMS)
    for k in range(2000):
        rot = matrix_from_quat(quat_from_rotation_vector(rng.normal(0.0, 0.3, 3)))
        u, dt = rng.normal(0.0, 1.0, 3), 0.004 + 0.002 * rng.random()
        book.predict(rot, u, dt)
        A, intensity = dynamics_matrix(rot), noise_intensity(x, PARAMS)
        x = predicted_state(x, A, u, dt, everything_valid())
        P = predicted_covariance(P, A, intensity, dt)
        if k % 5 == 0:
            index, sign = int(rng.integers(0, 6)), float(rng.choice((-1.0, 1.0)))
            y, r = float(rng.normal(0.0, 1.0)), float(0.5 + rng.random())
            residual, s = book.correct(index, sign, y, r)
            C = np.zeros((1, 10))
            C[0, index] = sign
            innovation = innovation_of(x, P, Measurement(np.array([y]), C, np.array([r])))
            assert innovation.residual[0] == pytest.approx(residual, abs=1e-9)
            assert innovation.S[0, 0] == pytest.approx(s, abs=1e-9)
            assert innovation.beta == pytest.approx(residual ** 2 / s, abs=1e-9)
            change, P = corrected(P, C, innovation)
            x = x + change
        np.testing.assert_allclose(x, book.x, rtol=0, atol=1e-9)
        np.testing.assert_allclose(P, book.P, rtol=0, atol=1e-9)


def test_a_vector_of_measurements_is_as_good_as_its_elements_one_by_one():
    rng = np.random.default_rng(5)
    half = rng.normal(size=(10, 10))
    P, x = half @ half.T, rng.normal(size=10)
    C, R, y = rng.normal(size=(6, 10)), 0.1 + rng.random(6), rng.normal(size=6)
    change, together = corrected(P, C, innovation_of(x, P, Measurement(y, C, R)))
    one_by_one, P_one = x.copy(), P
    for i in range(6):
        c = C[i:i + 1]
        innovation = innovation_of(one_by_one, P_one, Measurement(y[i:i + 1], c, R[i:i + 1]))
        step, P_one = corrected(P_one, c, innovation)
        one_by_one = one_by_one + step
    np.testing.assert_allclose(x + change, one_by_one, rtol=0, atol=1e-9)
    np.testing.assert_allclose(together, P_one, rtol=0, atol=1e-9)


def test_the_input_is_an_acceleration():
    np.testing.assert_array_equal(input_matrix() @ np.array((1.0, 2.0, 3.0)),
                                  [0, 0, 0, 1, 2, 3, 0, 0, 0, 0])


def test_thresholds_are_quantiles_of_chi_square():
    stats = pytest.importorskip('scipy.stats')
    for n, threshold in enumerate(correction.THRESHOLDS[1:], 1):
        assert stats.chi2.sf(threshold, n) == pytest.approx(0.003, abs=0.0008)


def test_what_is_not_valid_does_not_move():
    x = np.arange(10.0) + 1.0
    x[6:9] = 0.0
    after = predicted_state(x, dynamics_matrix(np.eye(3)), np.ones(3), 0.1, Validity())
    np.testing.assert_array_equal(after[[0, 1, 2, 3, 4, 9]], x[[0, 1, 2, 3, 4, 9]])
    assert after[5] == pytest.approx(x[5] + 0.1)


def test_the_bias_is_saturated():
    x = np.zeros(10)
    x[6:9] = 0.5, -0.5, 0.05
    after = predicted_state(
        x, dynamics_matrix(np.eye(3)), np.zeros(3), 0.01, everything_valid())
    np.testing.assert_allclose(after[6:9], [BIAS_MAX, -BIAS_MAX, 0.05])


def test_a_variance_above_the_limit_grows_no_more():
    P = initial_covariance(PARAMS)
    P[0, 0], P[0, 3] = 2.0 * VARIANCE_MAX, 1.0
    after = predicted_covariance(
        P, dynamics_matrix(np.eye(3)), noise_intensity(np.zeros(10), PARAMS), 0.1)
    assert (after[0] == P[0]).all()
    assert after[1, 1] > P[1, 1]


def test_terrain_noise_grows_with_speed():
    x = np.zeros(10)
    x[3:5] = 3.0, 4.0
    assert noise_intensity(x, PARAMS)[9] == pytest.approx((0.001 + 0.01 * 5.0) ** 2)


@pytest.mark.parametrize(('value', 'sound'), [
    (1.0, True), (0.0, False), (-1.0, False), (np.nan, False), (np.inf, False)])
def test_soundness_of_a_covariance(value, sound):
    P = initial_covariance(PARAMS)
    P[4, 4] = value
    assert is_sound(P) is sound


def step_validity(valid, sigma_v, sigma_z, *, aided, gnss, baro):
    P = np.eye(10)
    P[3, 3], P[4, 4] = sigma_v ** 2, 1e-4
    P[2, 2] = P[9, 9] = sigma_z ** 2
    valid.step(P, PARAMS, aided=aided, gnss=gnss, baro=baro)
    return valid.horizontal, valid.height, valid.terrain


def test_validity_needs_precision_and_an_aid_and_outlives_precision_while_the_aid_delivers():
    valid = Validity()
    off = {'aided': False, 'gnss': False, 'baro': False}
    on = {'aided': True, 'gnss': True, 'baro': True}
    assert step_validity(valid, 0.299, 0.999, **off) == (False, True, True)
    assert step_validity(valid, 0.301, 1.001, **off) == (False, False, False)
    assert step_validity(valid, 0.301, 1.001, **on) == (False, False, False)
    assert step_validity(valid, 0.299, 0.999, **on) == (True, True, True)
    assert step_validity(valid, 0.301, 1.001, **on) == (True, True, False)
    assert step_validity(valid, 0.299, 0.999, **off) == (True, True, True)
    assert step_validity(valid, 0.301, 1.001, **off) == (False, False, False)
