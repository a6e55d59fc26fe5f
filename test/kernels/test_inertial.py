"""Down-sampling of inertial increments: nothing is lost, and rotations are composed, not added."""

from __future__ import annotations

import numpy as np
import pytest

from ekf_fusion_ros.kernels.inertial import accumulate_imu
from ekf_fusion_ros.kernels.inertial import update_vibration

PERIOD = 0.01


class Downsampler:
    """Holds the arrays of the kernel."""

    def __init__(self):
        self.quat = np.array((1.0, 0.0, 0.0, 0.0))
        self.velocity, self.sums, self.out = np.zeros(3), np.zeros(1), np.zeros(8)
        self.clock = np.zeros(2, dtype=np.float32)

    def add(self, angle, velocity, dt):
        complete = accumulate_imu(np.asarray(angle), np.asarray(velocity), dt, dt, self.quat,
                                  self.velocity, self.clock, self.sums, self.out)
        return self.out.copy() if complete else None


def periods(rate, force, dt, count):
    """Return the filter periods (N, 8) of a constant rate and specific force."""
    sampler = Downsampler()
    found = [sampler.add(np.array(rate) * dt, np.array(force) * dt, dt) for _ in range(count)]
    return np.array([period for period in found if period is not None])


@pytest.mark.parametrize('ratio', [1.0, 1.0 / 2.0, 1.6, 1.0 / 3.0])
@pytest.mark.parametrize('axis', range(4))
def test_rates_survive_every_sample_rate(ratio, axis):
    rate, force = np.zeros(3), np.array((0.0, 0.0, -9.8))
    if axis < 3:
        rate[axis] = 0.7
        force = force * 0.0
    dt, count = ratio * PERIOD, 3000
    out = periods(rate, force, dt, count)
    np.testing.assert_allclose(out[:, 0:3] / out[:, 6:7], np.tile(rate, (len(out), 1)), rtol=1e-6)
    np.testing.assert_allclose(out[:, 3:6] / out[:, 7:8], np.tile(force, (len(out), 1)),
                               rtol=1e-9)
    assert out[:, 6].mean() == pytest.approx(max(PERIOD, dt), rel=1e-2)
    assert count * dt - out[:, 7].sum() < max(PERIOD, dt)
    assert out[:, 6].max() < max(PERIOD, dt) + 1.001 * dt


def test_coning_is_the_product_of_the_rotations():
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    rng = np.random.default_rng(5)
    angles = rng.normal(scale=0.2, size=(400, 3))
    sampler, product, compared = Downsampler(), rotation.identity(), 0
    for angle in angles:
        product = product * rotation.from_rotvec(angle)
        out = sampler.add(angle, np.zeros(3), 0.0025)
        if out is not None:
            np.testing.assert_allclose(out[0:3], product.as_rotvec(), atol=1e-12)
            product = rotation.identity()
            compared += 1
    assert compared > 90


def test_sculling_is_integrated_in_the_newest_body_frame():
    """A force that is fixed in inertial space while the body turns."""
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    rate, dt, force = np.array((2.0, -3.0, 4.0)), 0.0005, np.array((1.0, 5.0, -9.0))
    sampler, turned = Downsampler(), rotation.identity()
    out = None
    while out is None:
        # a strapdown sensor integrates the force in the frame at the beginning of its interval
        steps = (np.arange(64) + 0.5) / 64.0 * dt
        inside = turned * rotation.from_rotvec(np.outer(steps, rate))
        begin_to_inside = rotation.from_rotvec(np.outer(steps, rate))
        felt = inside.inv().apply(force)
        increment = begin_to_inside.apply(felt).mean(axis=0) * dt
        increment = rotation.from_rotvec(0.5 * rate * dt).inv().apply(increment)
        turned = turned * rotation.from_rotvec(rate * dt)
        out = sampler.add(rate * dt, increment, dt)
    expected = turned.inv().apply(force) * out[7]
    np.testing.assert_allclose(out[3:6], expected, atol=1e-7)
    assert np.abs(turned.inv().apply(force) - force).max() > 0.2


def test_vibration_metrics():
    previous, metrics = np.zeros(6), np.zeros(3)
    a, b = np.array((0.01, 0.0, 0.0)), np.array((0.0, 0.02, 0.0))
    v = np.array((0.0, 0.3, 0.4))
    update_vibration(a, v, previous, metrics)
    np.testing.assert_allclose(metrics, (0.0, 0.01 * 0.01, 0.01 * 0.5))
    update_vibration(b, v, previous, metrics)
    np.testing.assert_allclose(metrics, (
        0.01 * 0.01 * 0.02, 0.99e-4 + 0.01 * np.hypot(0.01, 0.02), 0.99 * 0.005))
    for _ in range(3000):
        update_vibration(b, v, previous, metrics)
    assert metrics.max() < 1e-12
