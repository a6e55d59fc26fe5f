"""In the air or on the ground, without anybody saying so."""

from __future__ import annotations

from dataclasses import replace

from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.params.ekf2 import AidingParams
from ekf_fusion_ros.params.ekf2 import AirDataParams
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


@pytest.mark.parametrize(('infers', 'rests'), [(True, False), (False, True)])
def test_even_motion_is_no_rest(infers, rests):
    bench = Bench(Ekf2Params(aiding=AidingParams(infer_in_air=infers)))
    bench.sending.add('fix')
    bench.run(12.0)
    assert 'vehicle_at_rest' in bench.flags
    bench.travel(2.0, 6.0)
    assert 'in_air' not in bench.flags
    assert ('vehicle_at_rest' in bench.flags) is rests
    assert bool(bench.ekf.control.checks.results['hdrift'].failed) is rests
    bench.travel(0.0, 6.0)
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


def bench_of(vehicle):
    """A level vehicle of a kind after 12 s, with fixes."""
    bench = Bench(Ekf2Params(aiding=AidingParams(vehicle=vehicle)))
    bench.sending.add('fix')
    bench.run(12.0)
    return bench


def test_fixed_wings_need_no_landed_sample_to_be_known():
    bench = bench_of('fixed_wing')
    assert 'fixed_wing' in bench.flags and 'fuse_beta' not in bench.flags
    bench.fix.velocity = np.array((0.0, 2.0, 0.0))
    for _ in range(10):
        shake(bench)
        bench.run(0.1)
    assert {'in_air', 'fuse_beta', 'wind'} <= bench.flags


def test_sideslip_of_fixed_wings_only_counts_in_flight():
    bench = bench_of('fixed_wing')
    bench.ekf.push(LandedSample(bench.now_us, landed=False))
    assert {'in_air', 'fixed_wing', 'fuse_beta'} <= bench.flags
    bench.ekf.push(LandedSample(bench.now_us, landed=True))
    assert 'fixed_wing' in bench.flags and not {'in_air', 'fuse_beta'} & bench.flags


def test_sideslip_of_fixed_wings_may_be_switched_off():
    bench = Bench(Ekf2Params(aiding=AidingParams(vehicle='fixed_wing'),
                             air_data=AirDataParams(use_sideslip=False)))
    bench.run(0.1)
    bench.ekf.push(LandedSample(bench.now_us, landed=False))
    assert {'in_air', 'fixed_wing'} <= bench.flags and 'fuse_beta' not in bench.flags


@pytest.mark.parametrize('vehicle', ['unspecified', 'multirotor', 'rover'])
def test_other_vehicles_may_slip(vehicle):
    bench = bench_of(vehicle)
    bench.fly()
    assert not {'fixed_wing', 'fuse_beta'} & bench.flags


@pytest.mark.parametrize('landed', [True, False])
def test_a_rover_is_on_the_ground_while_it_rests_whatever_is_said(landed):
    bench = bench_of('rover')
    bench.ekf.push(LandedSample(bench.now_us, landed=landed))
    bench.run(1.0)
    assert 'in_air' not in bench.flags
    bench.travel(1.0, 10.0)
    # an even speed: nothing shakes any more
    assert 'in_air' in bench.flags and bench.ekf.inertial.quiet
    bench.travel(0.0, 10.0)
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


def test_a_vehicle_that_is_never_quiet_starts_on_the_ground():
    """A flight that begins before anything is known counts from there."""
    bench = Bench()
    bench.sending.add('fix')
    bench.fix.velocity = np.array((0.0, 1.5, 0.0))
    for _ in range(80):
        shake(bench)
        bench.run(0.1)
    assert 'in_air' in bench.flags
    assert 0 < bench.ekf.filter.last_on_ground_us < bench.now_us
