"""Whatever the sensors do, the state stays finite, the covariance sound and the output usable."""

from __future__ import annotations

from ekf2.bench import GRAVITY
from ekf2.bench import Bench
from ekf2.bench import Fix
from ekf2.bench import Odometry
import numpy as np
import pytest

from ekf_fusion_ros.params.ekf2 import YAW_HOLDING
from ekf_fusion_ros.params.ekf2 import AidingParams
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssCheckParams
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.ekf2 import HeightParams
from ekf_fusion_ros.params.ekf2 import ImuParams
from ekf_fusion_ros.params.ekf2 import MagParams
from ekf_fusion_ros.params.ekf2 import VisionParams
from ekf_fusion_ros.samples import VelocityFrame

SENSORS = ('mag', 'baro', 'fix', 'vision')


def drawn_params(rng):
    def coin():
        return bool(rng.integers(2))

    checks = GnssCheckParams(health_time=1.0, start_time=1.0)
    return Ekf2Params(
        imu=ImuParams(position=tuple(rng.normal(size=3))),
        gnss=GnssParams(enabled=coin(), checks=checks, position=tuple(rng.normal(size=3))),
        vision=VisionParams(use_position=coin(), use_velocity=coin(), use_yaw=coin(),
                            rotate=coin(), velocity_tells_attitude=coin()),
        mag=MagParams(type=str(rng.choice(['auto', 'heading', 'three_axis', 'none']))),
        height=HeightParams(reference=str(rng.choice(['baro', 'gnss', 'vision']))),
        aiding=AidingParams(hold_yaw=str(rng.choice(YAW_HOLDING))))


def disturb(bench, rng):
    """Switch sensors, move, turn, jump; leave out fields; claim absurd variances."""
    bench.sending ^= {str(rng.choice(SENSORS))}
    bench.rate = rng.normal(scale=rng.choice([0.0, 0.3, 3.0]), size=3)
    bench.force = np.array((0.0, 0.0, -GRAVITY)) + rng.normal(
        scale=rng.choice([0.0, 1.0, 20.0]), size=3)
    bench.clipping = tuple(bool(c) for c in rng.random(3) < 0.1)
    bench.field = rng.normal(scale=0.3, size=3)
    bench.altitude += rng.choice([0.0, 1.0, 300.0]) * rng.normal()
    bench.fix = Fix(47.0 + 1e-4 * rng.normal(), 8.0 + 1e-4 * rng.normal(),
                    400.0 + 30.0 * rng.normal(), rng.normal(scale=5.0, size=3),
                    eph=float(rng.choice([0.01, 1.0, 1e3])), epv=float(rng.choice([0.01, 1e3])))
    if rng.random() < 0.3:
        bench.fix.velocity = np.full(3, np.nan)
        bench.fix.sacc = np.nan
    quaternion = rng.normal(size=4)
    odometry = Odometry(rng.normal(scale=30.0, size=3), quaternion / np.linalg.norm(quaternion),
                        rng.normal(scale=5.0, size=3))
    odometry.position_var = np.full(3, rng.choice([0.0, 0.1, 1e6]))
    odometry.velocity_cov = np.eye(3) * rng.choice([0.0, 0.1, 1e6])
    odometry.frame = VelocityFrame(int(rng.integers(2)))
    for name in ('position', 'quaternion', 'velocity'):
        if rng.random() < 0.2:
            setattr(odometry, name, np.full_like(getattr(odometry, name), np.nan))
    bench.odometry = odometry
    if rng.random() < 0.3:
        bench.fly()


def assert_sound(bench):
    f = bench.ekf.filter
    p = f.cov.p
    assert np.isfinite(f.x).all()
    assert np.isfinite(p).all()
    assert np.linalg.norm(f.x[0:4]) == pytest.approx(1.0, abs=1e-9)
    assert np.diag(p).min() >= 0.0
    np.testing.assert_allclose(p, p.T, rtol=1e-9, atol=1e-12)
    state = bench.ekf.nav_state()
    if state is not None:
        for values in (state.quaternion, state.velocity, state.position, state.pose_cov):
            assert np.isfinite(values).all()
    assert bench.ekf.health().text


@pytest.mark.parametrize('seed', range(12))
def test_disturbed_without_mercy(seed):
    rng = np.random.default_rng(seed)
    bench = Bench(drawn_params(rng))
    bench.now_us = int(rng.choice([0, 1_700_000_000_000_000]))
    bench.run(4.0)
    for _ in range(20):
        disturb(bench, rng)
        bench.run(float(rng.choice([0.3, 1.0])))
        assert_sound(bench)
    assert bench.ekf.initialised
