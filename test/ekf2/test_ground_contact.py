"""In the air or on the ground, without anybody saying so."""

from __future__ import annotations

from dataclasses import replace

from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.params.ekf2 import AidingParams
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.samples import LandedSample


@pytest.fixture
def bench():
    """A level vehicle after 5 s, with fixes."""
    bench = Bench()
    bench.sending.add('fix')
    bench.run(5.0)
    return bench


def shake(bench):
    """Turn to and fro faster than a vehicle at rest would."""
    bench.rate = np.array((0.0, 0.0, -0.1 if bench.rate[2] > 0.0 else 0.1))


def test_at_rest_it_stands_on_the_ground(bench):
    assert 'in_air' not in bench.flags


def test_a_shaking_vehicle_has_not_left_the_ground(bench):
    for _ in range(10):
        shake(bench)
        bench.run(0.1)
    assert 'in_air' not in bench.flags


@pytest.mark.parametrize(('speed', 'flies'), [(0.7, False), (1.5, True)])
def test_speed_tells_of_flight(bench, speed, flies):
    bench.fix.velocity = np.array((0.0, speed, 0.0))
    for _ in range(10):
        shake(bench)
        bench.run(0.1)
    assert ('in_air' in bench.flags) is flies


def test_a_climb_tells_of_flight(bench):
    for _ in range(60):
        shake(bench)
        bench.altitude += 0.05
        bench.run(0.1)
    assert 'in_air' in bench.flags


def test_quiet_means_landed(bench):
    bench.fix.velocity = np.array((0.0, 1.5, 0.0))
    for _ in range(10):
        shake(bench)
        bench.run(0.1)
    bench.fix.velocity, bench.rate = np.zeros(3), np.zeros(3)
    bench.run(4.0)
    assert 'in_air' not in bench.flags
    assert 'vehicle_at_rest' in bench.flags


def test_what_is_told_counts(bench):
    bench.ekf.push(LandedSample(bench.now_us, landed=True))
    bench.fix.velocity = np.array((0.0, 5.0, 0.0))
    for _ in range(10):
        shake(bench)
        bench.run(0.1)
    assert 'in_air' not in bench.flags


def test_the_profile_does_not_guess():
    bench = Bench(Ekf2Params(aiding=AidingParams(infer_in_air=False)))
    bench.sending.add('fix')
    bench.fix.velocity = np.array((0.0, 5.0, 0.0))
    for _ in range(60):
        shake(bench)
        bench.run(0.1)
    assert 'in_air' not in bench.flags


def velocity_error_after_a_lying_accelerometer(adapt):
    """Speed that the filter believes 3 s after its IMU began to claim 4 m/s^2 in vain."""
    params = Ekf2Params()
    params = replace(params, imu=replace(params.imu, adapt_accel_noise=adapt))
    bench = Bench(params)
    bench.sending.add('fix')
    bench.run(12.0)
    assert 'gps' in bench.flags
    bench.fly()
    bench.force = bench.force + np.array((4.0, 0.0, 0.0))
    bench.run(3.0)
    return float(np.hypot(*bench.x[4:6]))


def test_gnss_velocity_overrules_a_lying_accelerometer():
    constant = velocity_error_after_a_lying_accelerometer(False)
    adapted = velocity_error_after_a_lying_accelerometer(True)
    assert constant > 0.5
    assert adapted < 0.6 * constant
