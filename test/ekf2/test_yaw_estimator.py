"""The EKF-GSF bank finds yaw from inertial data and GNSS velocity alone."""

from __future__ import annotations

import math

from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.ekf2.yaw_estimator import YawEstimator
from ekf_fusion_ros.kernels.prediction import GRAVITY
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import MagParams
from ekf_fusion_ros.params.ekf2 import YawEstimatorParams

DT = 0.01


def push_forward(yaw, seconds, noise=0.0, seed=0):
    """Level, nose at `yaw`, speeding up and braking along the nose; return the bank."""
    bank, rng = YawEstimator(), np.random.default_rng(seed)
    nose, speed = np.array((math.cos(yaw), math.sin(yaw))), 0.0
    for k in range(round(seconds / DT)):
        begin = k < 100
        forward = 0.0 if begin else 3.0 * math.cos(2.0 * math.pi * (k * DT - 1.0) / 5.0)
        speed += forward * DT
        imu = np.concatenate([np.zeros(3), np.array((forward, 0.0, -GRAVITY)) * DT, [DT, DT]])
        bank.step(imu, not begin, 0.0, np.zeros(24), DT)
        if k % 20 == 0:
            measured = speed * nose + noise * rng.normal(size=2)
            bank.set_velocity(measured, max(noise, 0.1))
    return bank


@pytest.mark.parametrize('yaw_deg', [0.0, 37.0, 90.0, -150.0, 179.0])
def test_yaw_is_found(yaw_deg):
    bank = push_forward(math.radians(yaw_deg), 15.0)
    error = math.degrees(math.remainder(bank.yaw - math.radians(yaw_deg), 2.0 * math.pi))
    assert abs(error) < 3.0
    assert math.degrees(math.sqrt(bank.variance)) < 6.0


def test_the_stated_sigma_covers_the_error():
    errors, variances = [], []
    for seed in range(20):
        bank = push_forward(1.0, 12.0, noise=0.3, seed=seed)
        errors.append(math.remainder(bank.yaw - 1.0, 2.0 * math.pi))
        variances.append(bank.variance)
    assert np.mean(np.square(errors)) < 2.0 * np.mean(variances)
    assert np.sqrt(np.mean(np.square(errors))) < math.radians(10.0)


def bank_after_a_run(accuracy, epv):
    """Speed up to 8 m/s by fixes whose height is told to epv m; return yaw and variance."""
    bench = Bench(Ekf2Params(mag=MagParams(type='none'),
                             yaw_estimator=YawEstimatorParams(accuracy=accuracy)))
    bench.sending = {'baro', 'fix'}
    bench.fix.epv = epv
    bench.run(4.0)
    bench.fly()
    bench.travel(8.0, 10.0)
    bank = bench.ekf.control.bank
    return bank.yaw, bank.variance


def test_the_accuracy_of_the_height_is_none_of_the_velocity():
    usual = bank_after_a_run('speed', 1.2)
    assert bank_after_a_run('speed', 0.05) == bank_after_a_run('speed', 5.0) == usual
    # 1.2 m taken for 1.2 m/s is what the floor is; less makes it too sure
    assert bank_after_a_run('vertical', 1.2) == usual
    assert bank_after_a_run('vertical', 0.05)[1] < 0.25 * usual[1]


def test_without_motion_nothing_is_known():
    bank = YawEstimator()
    at_rest = np.concatenate([np.zeros(3), (0.0, 0.0, -GRAVITY * DT), [DT, DT]])
    for k in range(1000):
        bank.step(at_rest, True, 0.0, np.zeros(24), DT)
        if k % 20 == 0:
            bank.set_velocity(np.zeros(2), 0.3)
    assert bank.running
    assert math.sqrt(bank.variance) > 1.0


def test_it_waits_on_the_ground():
    bank = YawEstimator()
    at_rest = np.concatenate([np.zeros(3), (0.0, 0.0, -GRAVITY * DT), [DT, DT]])
    for _ in range(100):
        bank.set_velocity(np.zeros(2), 0.3)
        bank.step(at_rest, False, 0.0, np.zeros(24), DT)
    assert not bank.running


@pytest.mark.parametrize(('pitch', 'roll'), [
    (0.3, -0.5), (0.0, math.pi), (0.5 * math.pi, 0.0), (-0.5 * math.pi, 0.0)])
def test_tilt_at_the_start_is_that_of_gravity(pitch, roll):
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    tilt = rotation.from_euler('ZYX', (0.0, pitch, roll)).as_matrix()
    tilt[np.abs(tilt) < 1e-15] = 0.0
    bank = YawEstimator()
    force = tilt.T @ np.array((0.0, 0.0, -GRAVITY))
    bank.step(np.concatenate([np.zeros(3), force * DT, [DT, DT]]), False, 0.0, np.zeros(24), DT)
    for rot in bank.rot:
        np.testing.assert_allclose(rot[2], tilt[2], atol=1e-12)
        np.testing.assert_allclose(rot @ rot.T, np.eye(3), atol=1e-12)
