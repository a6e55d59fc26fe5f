"""From switch-on to a steady state, without and with fixes."""

from __future__ import annotations

from dataclasses import replace
import math

from ekf2.bench import GRAVITY
from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.ekf2.covariance import rotation_vector_variances
from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import GivenPose
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import ImuParams
from ekf_fusion_ros.params.ekf2 import TimingParams
from ekf_fusion_ros.samples import BaroSample

AT_REST = {'tilt_align', 'yaw_align', 'mag_hdg', 'baro_hgt', 'vehicle_at_rest'}


@pytest.fixture
def bench():
    """A level vehicle after 4 s."""
    bench = Bench()
    bench.run(4.0)
    return bench


def test_tilt_is_known_after_four_seconds(bench):
    variances = rotation_vector_variances(bench.x[0:4], bench.ekf.filter.cov.p)
    assert math.sqrt(variances[0] + variances[1]) < math.radians(3.0)
    assert 'tilt_align' in bench.flags


def test_modes_after_the_start(bench):
    assert bench.flags == AT_REST


def test_at_rest_everything_goes_to_zero(bench):
    bench.run(4.0)
    np.testing.assert_allclose(bench.x[4:16], 0.0, atol=1e-3)


def test_without_aiding_no_position_is_valid(bench):
    bench.run(3.0)
    state = bench.ekf.nav_state()
    assert not state.local_position_valid
    assert not state.global_position_valid
    assert state.dead_reckoning


def test_a_held_position_is_as_good_as_stated_on_the_ground_and_drifts_in_the_air(bench):
    bench.run(30.0)
    state = bench.ekf.nav_state()
    np.testing.assert_array_equal(state.pose_cov.diagonal()[0:3], bench.p[7:10])
    np.testing.assert_array_equal(state.velocity_cov.diagonal(), bench.p[4:7])
    bench.fly()
    bench.run(30.0)
    state = bench.ekf.nav_state()
    # a velocity that walks by 1 m/s per root of a second, for 30 s
    assert (state.pose_cov.diagonal()[0:2] > 0.95 * 30.0 ** 3 / 3.0).all()
    assert (state.velocity_cov.diagonal()[0:2] > 0.95 * 30.0).all()
    assert state.pose_cov[2, 2] == bench.p[9]
    bench.ekf.set_pose(GivenPose(np.zeros(3), np.full(3, 0.01), 0.0, 0.0))
    bench.run(1.0)
    # at 5.5 m/s, nobody knows where to, for 1 s
    assert 20.0 < bench.ekf.nav_state().pose_cov[0, 0] < 50.0


def test_fixes_are_used_after_eleven_seconds(bench):
    bench.sending.add('fix')
    bench.run(9.0)
    assert bench.flags == AT_REST
    bench.run(2.0)
    assert bench.flags == AT_REST | {'gps'}
    origin = bench.ekf.nav_state().origin
    assert (origin.lat, origin.lon) == (bench.fix.lat, bench.fix.lon)
    assert origin.alt == pytest.approx(bench.fix.alt, abs=0.05)
    assert bench.ekf.nav_state().global_position_valid


def test_the_bias_of_an_accelerometer_is_found():
    bench = Bench()
    bench.run(4.0)
    bench.sending.add('fix')
    bench.force = bench.force + np.array((0.0, 0.0, 0.1))
    bench.run(30.0)
    state = bench.ekf.nav_state()
    assert state.accel_bias[2] == pytest.approx(0.1, abs=0.01)
    np.testing.assert_allclose(state.position, 0.0, atol=0.05)
    np.testing.assert_allclose(state.velocity, 0.0, atol=0.02)


@pytest.mark.parametrize(('roll', 'pitch', 'yaw'), [
    (0.0, 0.0, 0.0), (0.0, 0.0, 90.0), (60.0, 30.0, 0.0), (0.0, 90.0, 0.0), (90.0, 0.0, 0.0)])
def test_attitude_at_the_start(roll, pitch, yaw):
    bench = Bench(Ekf2Params(), *np.radians((roll, pitch, yaw)))
    bench.run(4.0)
    found = bench.ekf.filter.rot
    np.testing.assert_allclose(found, bench.rot, atol=2e-4)
    np.testing.assert_allclose(bench.x[4:10], 0.0, atol=2e-3)
    assert bench.p[0:4].sum() > 1e-6
    assert bench.p[4:10].min() > 1e-5


@pytest.mark.parametrize(('roll', 'pitch', 'yaw', 'axes'), [
    (0.0, 0.0, 0.0, [2]), (0.0, 0.0, 90.0, [2]), (0.0, 90.0, 0.0, [0]), (90.0, 0.0, 0.0, [1]),
    # none is within 37 deg of the vertical
    (60.0, 30.0, 0.0, [])])
def test_only_the_bias_along_the_vertical_is_learned_at_rest(roll, pitch, yaw, axes):
    bench = Bench(Ekf2Params(), *np.radians((roll, pitch, yaw)))
    bench.run(2.0)
    first = bench.p[13:16].copy()
    bench.run(4.0)
    learned = bench.p[13:16] < 0.9 * first
    assert list(np.flatnonzero(learned)) == axes


def test_a_gyro_bias_does_not_become_an_accelerometer_bias():
    bench = Bench()
    bench.run(1.0)
    bench.sending.add('fix')
    bench.run(20.0)
    bench.rate = np.array((0.0, 0.0, 0.1))
    largest = 0.0
    for _ in range(50):
        bench.run(1.0)
        largest = max(largest, abs(bench.ekf.nav_state().accel_bias[2]))
    assert largest < 0.3
    assert abs(bench.attitude[0:2]).max() < math.radians(3.0)


def test_no_start_while_turning_or_accelerating():
    for rate, force in (((0.3, 0.0, 0.0), (0.0, 0.0, -GRAVITY)),
                        ((0.0, 0.0, 0.0), (0.0, 0.0, -1.3 * GRAVITY))):
        bench = Bench()
        bench.rate, bench.force = np.array(rate), np.array(force)
        bench.run(3.0)
        assert not bench.ekf.initialised
        assert bench.ekf.nav_state() is None


def test_fast_pressure_samples_are_averaged(bench):
    bench.sending.discard('baro')
    ekf, sign = bench.ekf, 1.0
    seen = []
    for _ in range(200):
        for k in range(100):
            ekf.push(BaroSample(bench.now_us + k * 100, bench.altitude + sign))
            sign = -sign
        bench.run(0.01)
        if ekf.control.baro.popped:
            seen.append(ekf.control.baro.altitude - bench.altitude)
    assert len(seen) > 50
    np.testing.assert_allclose(seen[5:], 0.0, atol=0.011)


def test_moving_the_origin_keeps_the_place_on_the_earth(bench):
    bench.sending.add('fix')
    bench.run(12.0)
    moved = GeoPoint(bench.fix.lat + 0.001, bench.fix.lon, bench.fix.alt - 10.0)
    assert bench.ekf.set_origin(moved)
    state = bench.ekf.nav_state()
    # A thousandth of a degree of latitude is 111.2 m at 47 N.
    np.testing.assert_allclose(state.position, (-111.2, 0.0, -10.0), atol=0.3)
    bench.run(3.0)
    np.testing.assert_allclose(bench.ekf.nav_state().position, state.position, atol=0.05)
    rejected = {s.name: s.test_ratio for s in bench.ekf.aid_statuses() if s.active}
    assert max(rejected.values()) < 0.1


def test_an_origin_may_be_given_without_fixes(bench):
    assert bench.ekf.nav_state().origin is None
    assert bench.ekf.set_origin(GeoPoint(-30.0, 170.0, 100.0))
    origin = bench.ekf.nav_state().origin
    assert (origin.lat, origin.lon, origin.alt) == (-30.0, 170.0, 100.0)
    assert not bench.ekf.set_origin(GeoPoint(math.nan, 0.0, 0.0))
    assert not bench.ekf.set_origin(GeoPoint(91.0, 0.0, 0.0))
    assert not bench.ekf.set_origin(GeoPoint(10.0, 0.0, math.nan))
    assert bench.ekf.nav_state().origin == origin


def test_an_origin_without_fixes_moves_with_its_setting(bench):
    """The vehicle stays where it is on the earth, so that its position moves the other way."""
    assert bench.ekf.set_origin(GeoPoint(-30.0, 170.0, 100.0))
    before = bench.ekf.nav_state().position
    assert bench.ekf.set_origin(GeoPoint(-30.001, 170.0, 120.0))
    bench.run(2.0)
    moved = bench.ekf.nav_state().position - before
    # A thousandth of a degree of latitude is 110.9 m at 30 S.
    np.testing.assert_allclose(moved, (110.9, 0.0, 20.0), atol=0.3)
    assert bench.resets.pos_ne == bench.resets.pos_d == 1
    assert max(s.test_ratio for s in bench.ekf.aid_statuses() if s.active) < 0.1


def test_reset_forgets_everything(bench):
    bench.ekf.reset()
    assert not bench.ekf.initialised
    fresh = Ekf2()
    np.testing.assert_array_equal(bench.x, fresh.filter.x)
    assert bench.ekf.aid_statuses() == []


def test_output_is_ahead_of_the_horizon_by_the_delay():
    params = replace(Ekf2Params(), timing=TimingParams(horizon_min_ms=300.0))
    bench = Bench(params)
    bench.run(4.0)
    bench.sending.add('fix')
    bench.run(12.0)
    bench.fly()
    # one second at 1 m/s^2 north, then constant speed; fixes follow
    start = bench.fix.lat
    for k in range(600):
        t = 0.01 * (k + 1)
        bench.force = np.array((1.0 if t <= 1.0 else 0.0, 0.0, -GRAVITY))
        delayed = max(t - 0.11, 0.0)
        travelled = 0.5 * delayed ** 2 if delayed < 1.0 else delayed - 0.5
        bench.fix.lat = start + travelled / 111_180.0
        bench.fix.velocity = np.array((min(delayed, 1.0), 0.0, 0.0))
        bench.run(0.01)
    state, f = bench.ekf.nav_state(), bench.ekf.filter
    delay = 1e-6 * (f.t_now - f.t_horizon)
    assert delay == pytest.approx(0.3, abs=0.015)
    assert state.velocity[0] == pytest.approx(1.0, abs=0.05)
    assert state.position[0] - bench.x[7] == pytest.approx(delay, abs=0.03)
    assert state.position[0] == pytest.approx(5.5, abs=0.15)


def test_imu_place_is_taken_off_the_output():
    params = Ekf2Params(imu=ImuParams(position=(0.4, -0.2, 0.1)))
    bench = Bench(params, yaw=math.radians(90.0))
    bench.run(4.0)
    position = bench.ekf.nav_state().position
    # Turned by 90 deg, 0.4 m ahead are east and 0.2 m to the left are north.
    np.testing.assert_allclose(position, (-0.2, -0.4, -0.1), atol=5e-3)


@pytest.mark.parametrize(('spoil', 'words'), [
    (lambda bench: setattr(bench, 'force', bench.force / GRAVITY), 'specific force is 1.0 m/s^2'),
    (lambda bench: setattr(bench, 'rate', np.array((0.0, 0.0, 1.0))), 'turns at 57 deg/s'),
    (lambda bench: bench.sending.remove('baro'), 'samples of the barometer'),
    (lambda bench: bench.sending.clear(), 'samples of the magnetometer'),
])
def test_what_keeps_the_filter_from_starting_is_said(spoil, words):
    """An IMU in units of g, a start in a turn, sensors that are configured and silent."""
    bench = Bench()
    spoil(bench)
    bench.run(4.0)
    assert bench.ekf.nav_state() is None
    assert words in bench.ekf.health().text
