"""The compass on the bench, and what happens when height sources misbehave."""

from __future__ import annotations

import math

from ekf2.bench import EARTH_FIELD
from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.ekf2 import HeightParams
from ekf_fusion_ros.params.ekf2 import MagParams
from ekf_fusion_ros.params.ekf2 import VisionParams
from ekf_fusion_ros.samples import VelocityFrame

NO_FIXES = GnssParams(enabled=False)


def compass(**mag):
    bench = Bench(Ekf2Params(gnss=NO_FIXES, mag=MagParams(**mag)))
    bench.run(4.5)
    return bench


def turned_field(yaw):
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0))) @ EARTH_FIELD


@pytest.mark.parametrize('declination_deg', [0.0, 12.0, -40.0])
def test_yaw_refers_to_true_north(declination_deg):
    bench = compass(type='heading', declination_deg=declination_deg)
    assert math.degrees(bench.attitude[2]) == pytest.approx(declination_deg, abs=0.1)
    assert 'mag_hdg' in bench.flags


def test_three_axes_on_request():
    bench = compass(type='three_axis')
    assert {'mag_3d', 'mag_dec'} <= bench.flags
    np.testing.assert_allclose(bench.x[16:19], EARTH_FIELD, atol=0.01)


def test_without_a_compass_yaw_is_not_aligned_but_its_variance_is_bounded():
    bench = compass(type='none')
    assert 'yaw_align' not in bench.flags
    bench.run(20.0)
    assert bench.p[0:4].sum() < 0.01


def test_yaw_follows_a_turn():
    bench = compass(type='heading')
    bench.rate = np.array((0.0, 0.0, 0.5))
    for k in range(200):
        bench.field = turned_field(0.5 * 0.01 * (k + 1))
        bench.run(0.01)
    bench.rate = np.zeros(3)
    bench.run(1.0)
    assert bench.attitude[2] == pytest.approx(1.0, abs=0.01)
    assert bench.ekf.nav_state().yaw_aligned


def test_a_disturbed_field_does_not_turn_a_vehicle_at_rest():
    bench = compass(type='heading', check_strength=True)
    bench.field = 5.0 * turned_field(1.0)
    bench.run(4.0)
    assert 'mag_disturbed' in bench.flags
    assert bench.attitude[2] == pytest.approx(0.0, abs=0.01)


def test_a_glitch_of_the_barometer_is_rejected_and_a_new_level_is_taken_in_time():
    bench = Bench(Ekf2Params(gnss=NO_FIXES))
    bench.run(8.0)
    resets = bench.resets.pos_d
    bench.altitude += 60.0
    bench.run(3.0)
    assert bench.x[9] == pytest.approx(0.0, abs=0.3)
    (status,) = [s for s in bench.ekf.aid_statuses() if s.name == 'baro_height']
    assert status.innovation_rejected
    assert status.rejected > 30
    bench.run(4.0)
    assert bench.resets.pos_d == resets + 1
    assert bench.x[9] == pytest.approx(-60.0, abs=1.0)
    assert told_resets(bench) == [
        'reset height: height source timed out; now barometric height, 60.0 m higher']


def told_resets(bench):
    return [event.text for event in bench.ekf.drain_events() if 'reset height' in event.text]


def test_a_jump_that_the_accelerometer_contradicts_is_no_time_out():
    bench = Bench()
    bench.sending.add('fix')
    bench.run(15.0)
    bench.altitude += 100.0
    bench.fix.velocity = np.array((0.0, 0.0, -0.1))
    bench.run(2.0)
    assert told_resets(bench)[0] == ('reset height: the accelerometer contradicts the height; '
                                     'now barometric height, 100.0 m higher')
    told = bench.ekf.health()
    assert told.level == HealthLevel.WARN
    assert told.text.startswith('the accelerometer contradicts the height sensors: vibration, or')
    bench.run(15.0)
    assert bench.ekf.health().level == HealthLevel.OK


def test_the_output_jumps_with_a_reset_of_the_filter():
    bench = Bench(Ekf2Params(gnss=NO_FIXES))
    bench.run(8.0)
    before, resets = bench.ekf.nav_state().position[2], bench.resets.pos_d
    bench.altitude += 60.0
    while bench.resets.pos_d == resets:
        bench.run(0.01)
    jump = bench.resets.d_pos_d
    assert jump == pytest.approx(-60.0, abs=1.0)
    assert bench.ekf.nav_state().position[2] - before == pytest.approx(jump, abs=0.5)


def test_an_accelerometer_at_its_range_raises_the_velocity_noise():
    bench = Bench()
    bench.run(5.0)
    before = bench.p[4:7].copy()
    bench.clipping = (False, False, True)
    bench.run(0.5)
    assert bench.ekf.filter.faults.accel_clipping
    # 4.9 m/s^2 in steps of 10 ms for half a second, less what the barometer takes away.
    growth = 50 * 0.049 ** 2
    assert 0.4 * growth < bench.p[6] - before[2] < growth
    assert abs(bench.p[4] - before[0]) < 0.1 * growth


def climbed(*, sending):
    """Climb 30 m on GNSS height with the velocity of odometry, then lose the fixes for 30 s."""
    bench = Bench(Ekf2Params(height=HeightParams(reference='gnss'),
                             vision=VisionParams(use_velocity=True)))
    bench.sending = {'mag', 'fix', 'vision'} | sending
    bench.odometry.frame = VelocityFrame.BODY_FRD
    bench.run(20.0)
    for speed, seconds in ((1.0, 30.0), (0.0, 5.0)):
        bench.fix.velocity = bench.odometry.velocity = np.array((0.0, 0.0, -speed))
        for _ in range(round(10.0 * seconds)):
            bench.fix.alt += 0.1 * speed
            bench.altitude += 0.1 * speed
            bench.run(0.1)
    bench.sending.discard('fix')
    bench.run(30.0)
    return bench


def test_height_is_dead_reckoned_where_odometry_tells_the_climb():
    bench = climbed(sending=set())
    assert not {'gps_hgt', 'baro_hgt'} & bench.flags
    assert bench.x[9] == pytest.approx(-30.0, abs=1.0)


def test_height_is_held_where_nothing_tells_the_climb():
    bench = climbed(sending=set())
    bench.sending.discard('vision')
    bench.run(30.0)
    assert bench.x[9] == pytest.approx(-30.0, abs=2.0)


def test_the_barometer_takes_over_when_gnss_height_ends():
    bench = climbed(sending={'baro'})
    assert 'baro_hgt' in bench.flags
    bench.altitude += 1.0
    bench.run(20.0)
    assert bench.x[9] == pytest.approx(-31.0, abs=1.0)


def test_fixes_without_altitude_cannot_take_over_the_height():
    bench = Bench()
    bench.sending = {'mag', 'baro', 'fix'}
    bench.run(15.0)
    bench.fix.alt = math.nan
    bench.sending.discard('baro')
    bench.run(10.0)
    assert 'gps' in bench.flags
    assert 'gps_hgt' not in bench.flags
    assert np.isfinite(bench.x).all()


@pytest.mark.parametrize('by_hand', [False, True])
def test_height_on_gnss_survives_the_setting_of_the_origin(by_hand):
    bench = Bench()
    bench.sending = {'mag', 'baro', 'fix'}
    bench.run(2.0)
    bench.sending.discard('baro')
    bench.run(6.0)
    assert 'gps_hgt' in bench.flags
    if by_hand:
        assert bench.ekf.set_origin(GeoPoint(bench.fix.lat, bench.fix.lon, 100.0))
    bench.run(20.0)
    assert 'gps' in bench.flags
    assert bench.x[9] == pytest.approx(0.0, abs=0.1)
