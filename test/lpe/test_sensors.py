"""Each sensor of LPE: how it starts, corrects, is found faulty, and times out."""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
import pytest

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.lpe.lpe import Lpe
from ekf_fusion_ros.lpe.state import TERRAIN
from ekf_fusion_ros.params.lpe import FlowParams
from ekf_fusion_ros.params.lpe import LpeParams
from ekf_fusion_ros.params.lpe import OriginParams
from ekf_fusion_ros.params.lpe import VisionParams
from ekf_fusion_ros.samples import AuxVelocitySample
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import FlowSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.samples import RangeSample
from ekf_fusion_ros.samples import VisionSample

STEP_US = 10_000
START_US = 1_700_000_000_000_000
PLACE = GeoPoint(47.4, 8.5, 500.0)
LEVEL = np.array((1.0, 0.0, 0.0, 0.0))


class Bench:
    """A body that stands still, level unless tilted, at 100 Hz; samples as each test wants."""

    def __init__(self, params=None, quaternion=LEVEL):
        self.lpe = Lpe(params)
        self.time_us = START_US
        self.quaternion = quaternion
        self.events = []

    def run(self, seconds, *sources):
        """Step; each source is (rate Hz, function of the stamp) and comes just before the IMU."""
        for _ in range(round(100 * seconds)):
            self.time_us += STEP_US
            for rate, make in sources:
                if (self.time_us - START_US) % round(1e6 / rate) == 0:
                    self.lpe.push(make(self.time_us))
            rot = self.lpe.filter.attitude.rot
            force = rot.T @ np.array((0.0, 0.0, -9.80665))
            if not self.lpe.initialised:
                force = np.array((0.0, 0.0, -9.80665))
            self.lpe.push(ImuSample(self.time_us, np.zeros(3), force * 0.01, 0.01, 0.01,
                                    orientation=self.quaternion))
            self.lpe.update()
        self.events += [event.text for event in self.lpe.drain_events()]
        return self

    @property
    def x(self):
        return self.lpe.states()

    def sensor(self, name):
        return next(s for s in self.lpe.sensors.all if s.name == name)

    def status(self, name):
        return next(s for s in self.lpe.aid_statuses() if s.name == name)


def baro(altitude=300.0):
    return 50, lambda t: BaroSample(t, altitude)


def fix(north=0.0, east=0.0, down=0.0, **changes):
    lat, lon = make_projection('wgs84', PLACE.lat, PLACE.lon, PLACE.alt).reproject(north, east)
    fields = {'velocity': np.zeros(3), 'sacc': 0.2, 'nsats': 10, **changes}
    eph, epv = fields.pop('eph', 1.0), fields.pop('epv', 2.0)
    return 10, lambda t: GnssSample(t, lat, lon, PLACE.alt - down, eph, epv, **fields)


def distance(d, *, ultrasound=False, rate=20, **changes):
    return rate, lambda t: RangeSample(t, d, -1, 0.2, 20.0, ultrasound=ultrasound, **changes)


def vision(*position, sigma=0.1, resets=0):
    return 25, lambda t: VisionSample(
        t, np.array(position), np.full(4, math.nan), position_var=np.full(3, sigma ** 2),
        reset_counter=resets)


def landed(value):
    return 1, lambda t: LandedSample(t, value)


def target(north, east, variance=0.01):
    return 20, lambda t: AuxVelocitySample(
        t, np.array((north, east, 0.0)), np.full(3, variance))


# -- barometer --------------------------------------------------------------------------------


def test_baro_needs_101_samples_and_refers_to_where_it_began():
    bench = Bench().run(2.0, baro())
    assert bench.sensor('baro').timed_out
    bench.run(0.02, baro())
    assert not bench.sensor('baro').timed_out
    assert 'baro initialised' in bench.events
    bench.run(20.0, baro(302.0))
    assert bench.x[2] == pytest.approx(-2.0, abs=0.1)


def test_baro_that_comes_back_keeps_the_height():
    bench = Bench().run(3.0, baro()).run(20.0, baro(302.0))
    height = bench.x[2]
    bench.run(1.0)
    assert 'baro timed out' in bench.events
    bench.run(10.0, baro(350.0))
    assert bench.x[2] == pytest.approx(height, abs=0.2)


def test_baro_far_off_is_told_as_a_fault_and_corrects_all_the_same():
    bench = Bench().run(5.0, baro()).run(0.1, baro(340.0))
    assert bench.sensor('baro').faulty
    assert 'baro contradicts the estimate' in bench.events
    before = bench.x[2]
    bench.run(30.0, baro(340.0))
    assert bench.x[2] < before - 5.0
    assert 'baro agrees with the estimate again' in bench.events


# -- GNSS -------------------------------------------------------------------------------------


def test_fixes_place_the_origin_and_correct():
    bench = Bench().run(1.0, fix())
    assert bench.lpe.nav_state().origin is None
    bench.run(0.2, fix())
    origin = bench.lpe.nav_state().origin
    assert (origin.lat, origin.lon) == pytest.approx((PLACE.lat, PLACE.lon), abs=1e-7)
    assert origin.alt == pytest.approx(500.0, abs=0.1)
    bench.run(30.0, fix(5.0, -3.0, -2.0))
    assert bench.x[:3] == pytest.approx((5.0, -3.0, -2.0), abs=0.3)
    assert bench.lpe.nav_state().global_position_valid


@pytest.mark.parametrize(('changes', 'starts'), [
    ({'nsats': 6}, True), ({'nsats': 5}, False), ({'nsats': None}, True),
    ({'eph': 3.0}, True), ({'eph': 3.01}, False), ({'epv': 5.0}, True), ({'epv': 5.01}, False),
    ({'fix_type': 2}, False)])
def test_what_fixes_must_be_to_start(changes, starts):
    bench = Bench().run(3.0, fix(**changes))
    assert bench.sensor('gnss').timed_out is not starts


def test_poor_fixes_go_on_correcting_once_started_with_their_own_noise():
    bench = Bench().run(3.0, fix()).run(1.0, fix(eph=8.0, epv=9.0, sacc=1.0))
    status = bench.status('gnss')
    assert status.active
    assert status.innovation_variance[0] > 64.0
    assert status.innovation_variance[5] > 1.0


def test_a_bad_fix_in_between_begins_the_count_again():
    bench = Bench().run(1.0, fix()).run(0.1, fix(eph=9.0)).run(1.0, fix())
    assert bench.sensor('gnss').timed_out
    assert bench.lpe.passed_over()[GnssSample] == {'not_good_enough_to_start': 1}
    assert not bench.run(0.1, fix()).sensor('gnss').timed_out


def test_fixes_without_velocity_are_three_measurements():
    bench = Bench().run(3.0, fix(velocity=np.full(3, math.nan), sacc=math.nan))
    assert len(bench.status('gnss').innovation) == 3


def test_fixes_time_out_after_a_second_and_the_map_stays():
    bench = Bench().run(3.0, fix()).run(1.0)
    assert not bench.sensor('gnss').timed_out
    bench.run(0.2)
    assert bench.sensor('gnss').timed_out
    origin = bench.lpe.nav_state().origin
    bench.run(3.0, fix(10.0))
    assert bench.lpe.nav_state().origin == origin
    assert bench.lpe.nav_state().dead_reckoning is False


def test_fixes_far_off_are_told_as_a_fault_at_a_wide_tolerance():
    bench = Bench().run(10.0, fix()).run(0.1, fix(30.0))
    assert not bench.sensor('gnss').faulty
    bench = Bench().run(10.0, fix()).run(0.1, fix(500.0))
    assert bench.sensor('gnss').faulty
    assert bench.status('gnss').rejected == 0


def test_the_state_of_its_time_is_what_a_fix_is_compared_with():
    """At 2 m/s a fix 0.11 s old lies 0.22 m behind."""
    bench = Bench().run(3.0, fix())
    bench.lpe.filter.x[3] = 2.0
    bench.run(0.45)
    north = bench.x[0]
    bench.run(0.05, fix(north - 0.22, velocity=np.array((2.0, 0.0, 0.0))))
    innovation = bench.status('gnss').innovation
    assert innovation[0] == pytest.approx(0.02 * 10 * 0.2, abs=0.1)


def test_the_fix_is_moved_from_the_antenna_to_the_body():
    params = LpeParams()
    half = math.sqrt(0.5)
    east = np.array((half, 0.0, 0.0, half))
    params = replace(params, gnss=replace(params.gnss, position=(1.0, 0.0, -0.5)))
    bench = Bench(params, quaternion=east).run(3.0, fix()).run(20.0, fix(0.0, 1.0, -0.5))
    assert bench.x[:3] == pytest.approx((0.0, 0.0, 0.0), abs=0.02)


def test_fixes_too_late_are_counted():
    bench = Bench().run(3.0, fix())
    rate, make = fix()
    bench.run(0.3, (rate, lambda t: make(t - 450_000)))
    assert bench.lpe.passed_over()[GnssSample] == {'too_late': 3}


# -- lidar and sonar --------------------------------------------------------------------------


@pytest.mark.parametrize(('name', 'ultrasound'), [('lidar', False), ('sonar', True)])
def test_range_finders_start_correct_are_faulty_and_time_out(name, ultrasound):
    bench = Bench().run(3.0, baro(), distance(4.0, ultrasound=ultrasound))
    assert f'{name} initialised' in bench.events
    assert bench.lpe.filter.agl == pytest.approx(4.0, abs=0.05)
    bench.run(5.0, baro(), distance(4.1, ultrasound=ultrasound))
    assert bench.lpe.filter.agl == pytest.approx(4.1, abs=0.05)
    assert bench.lpe.nav_state().ground_down == pytest.approx(bench.x[TERRAIN], abs=0.05)
    before = bench.lpe.filter.agl
    bench.run(0.2, baro(), distance(15.0, ultrasound=ultrasound))
    assert bench.sensor(name).faulty
    assert bench.lpe.filter.agl == pytest.approx(before, abs=0.05)
    assert bench.status(name).innovation_rejected
    bench.run(0.2, baro(), distance(4.1, ultrasound=ultrasound))
    assert not bench.sensor(name).faulty
    bench.run(1.05 if name == 'lidar' else 5.05, baro())
    assert f'{name} timed out' in bench.events


def test_distance_counts_by_the_cosine_of_the_tilt():
    half = 0.5 * math.radians(20.0)
    tilted = np.array((math.cos(half), math.sin(half), 0.0, 0.0))
    bench = Bench(quaternion=tilted).run(3.0, distance(5.0))
    assert bench.lpe.filter.agl == pytest.approx(5.0 * math.cos(math.radians(20.0)), abs=0.02)


@pytest.mark.parametrize(('d', 'used'), [
    (0.2, False), (0.2101, True), (19.9899, True), (20.0, False)])
def test_distances_count_a_centimetre_inside_the_limits(d, used):
    assert Bench().run(2.0, distance(d)).sensor('lidar').timed_out is not used


def test_a_sensor_that_knows_its_noise_is_believed():
    told = Bench().run(5.0, distance(4.0, variance=0.25)).status('lidar')
    silent = Bench().run(5.0, distance(4.0)).status('lidar')
    assert told.innovation_variance[0] > 0.25
    assert silent.innovation_variance[0] < 0.01


def test_sonar_that_scatters_does_not_start():
    def echo(t):
        return RangeSample(t, 4.0 + 1.5 * ((t // 50_000) % 2), -1, 0.2, 20.0, ultrasound=True)

    bench = Bench().run(4.0, (20, echo))
    assert bench.sensor('sonar').timed_out
    assert bench.lpe.passed_over()[RangeSample]['not_good_enough_to_start'] > 10


def test_sonar_too_slow_to_start_within_5_s():
    bench = Bench().run(20.0, distance(4.0, ultrasound=True, rate=1))
    assert bench.sensor('sonar').timed_out


def test_sonar_rests_while_a_lidar_corrects():
    both = distance(4.0), distance(4.0, ultrasound=True)
    bench = Bench().run(3.0, *both)
    assert bench.lpe.passed_over()[RangeSample]['lidar_is_better'] > 10
    fused = bench.status('sonar').fused
    bench.run(2.0, both[1])
    assert bench.status('sonar').fused > fused + 10


def test_a_lidar_switched_on_in_the_air_does_not_contradict():
    bench = Bench().run(5.0, baro()).run(20.0, baro(330.0)).run(3.0, baro(330.0), distance(18.0))
    assert not bench.sensor('lidar').faulty
    assert bench.lpe.filter.agl == pytest.approx(18.0, abs=0.2)


# -- optical flow -----------------------------------------------------------------------------

FLOW = LpeParams(flow=FlowParams(enabled=True))


def flow(forward=0.0, right=0.0, height=4.0, turn=(0.0, 0.0), quality=255, dt=0.05):
    """Angles of the scene at a height for a velocity, while the body turns by `turn` rad."""
    scene = np.array((right, -forward)) * dt / height - np.array(turn)
    gyro = np.array((-turn[0], -turn[1], 0.0))
    return 20, lambda t: FlowSample(t, scene, gyro, quality, dt)


def test_flow_starts_once_the_ground_is_known_and_gives_velocity():
    bench = Bench(FLOW).run(2.0, flow())
    assert bench.sensor('optical_flow').timed_out
    bench.run(4.0, baro(), distance(4.0), flow())
    assert 'optical_flow initialised' in bench.events
    bench.run(10.0, baro(), distance(4.0), flow(0.3, -0.2))
    assert bench.x[3:5] == pytest.approx((0.3, -0.2), abs=0.05)
    assert bench.lpe.nav_state().local_position_valid


def test_rotation_is_taken_off_the_flow():
    spinning = flow(turn=(0.01, -0.02))
    bench = Bench(FLOW).run(4.0, baro(), distance(4.0), flow())
    bench.run(5.0, baro(), distance(4.0), spinning)
    assert bench.x[3:5] == pytest.approx((0.0, 0.0), abs=0.05)


@pytest.mark.parametrize(('changes', 'reason'), [
    ({'quality': 149}, 'bad_quality'), ({'dt': 0.51}, 'bad_interval')])
def test_flow_that_is_unusable_is_counted_by_reason(changes, reason):
    bench = Bench(FLOW).run(4.0, baro(), distance(4.0), flow())
    bench.run(1.0, baro(), distance(4.0), flow(**changes))
    assert bench.lpe.passed_over()[FlowSample][reason] == 20


def test_flow_jumps_are_faults_that_are_dropped_and_silence_times_out():
    bench = Bench(FLOW).run(6.0, baro(), distance(4.0), flow())
    before = bench.x[3:5]
    bench.run(0.1, baro(), distance(4.0), flow(8.0, 8.0))
    assert bench.sensor('optical_flow').faulty
    assert bench.x[3:5] == pytest.approx(before, abs=0.05)
    bench.run(1.2, baro(), distance(4.0))
    assert 'optical_flow timed out' in bench.events


# -- vision and motion capture ----------------------------------------------------------------


def seeing(kind='vision', **changes):
    return LpeParams(vision=VisionParams(enabled=True, kind=kind), **changes)


@pytest.mark.parametrize(('kind', 'samples', 'timeout'), [
    ('vision', 2, 0.5), ('mocap', 21, 0.2)])
def test_positions_start_correct_and_time_out(kind, samples, timeout):
    bench = Bench(seeing(kind))
    bench.run(0.04 * (samples - 1), vision(1.0, 2.0, -3.0))
    assert bench.sensor(kind).timed_out
    bench.run(0.04, vision(1.0, 2.0, -3.0))
    assert not bench.sensor(kind).timed_out
    bench.run(10.0, vision(1.0, 2.0, -3.0))
    assert bench.x[:3] == pytest.approx((1.0, 2.0, -3.0), abs=0.1)
    bench.run(timeout + 0.03)
    assert f'{kind} timed out' in bench.events


def test_a_position_without_accuracy_has_the_least_noise_and_one_poor_axis_counts():
    bench = Bench(seeing()).run(2.0, vision(1.0, 0.0, 0.0, sigma=math.nan))
    assert bench.x[0] == pytest.approx(1.0, abs=0.1)
    _, untold = vision(1.0, 0.0, 0.0, sigma=math.nan)
    sensor = bench.sensor('vision')
    measured = sensor.measure(untold(bench.time_us))
    assert sensor.model(measured).R == pytest.approx((0.01, 0.01, 0.25))
    poor = vision(1.0, 0.0, 0.0)[1](bench.time_us)._replace(
        position_var=np.array((math.nan, 101.0 ** 2, 1.0)))
    assert sensor.measure(poor) is None


def test_vision_drops_a_fault_and_mocap_corrects_by_it():
    steps = {}
    for kind in ('vision', 'mocap'):
        bench = Bench(seeing(kind)).run(10.0, vision(0.0, 0.0, 0.0))
        bench.run(0.08, vision(20.0, 0.0, 0.0))
        assert bench.sensor(kind).faulty
        steps[kind] = bench.x[0]
    assert abs(steps['vision']) < 0.05
    assert steps['mocap'] > 1.0


def test_a_frame_that_says_it_jumped_does_not_move_the_vehicle():
    bench = Bench(seeing()).run(10.0, vision(1.0, 0.0, 0.0))
    bench.run(5.0, vision(31.0, 7.0, 0.0, resets=1))
    assert bench.x[:2] == pytest.approx((1.0, 0.0), abs=0.1)


@pytest.mark.parametrize(('sample', 'reason'), [
    (vision(math.nan, 0.0, 0.0), 'no_position'), (vision(0.0, 0.0, 0.0, sigma=101.0),
                                                  'not_accurate')])
def test_positions_that_are_unusable_are_counted(sample, reason):
    bench = Bench(seeing()).run(1.0, sample)
    assert bench.sensor('vision').timed_out
    assert bench.lpe.passed_over()[VisionSample][reason] == 25


def test_without_fixes_the_parameters_place_the_map_and_a_fix_replaces_that():
    params = seeing(origin=OriginParams(fake=True, latitude=10.0, longitude=20.0))
    bench = Bench(params).run(10.0, vision(0.0, 0.0, 0.0))
    assert bench.lpe.nav_state().origin == GeoPoint(10.0, 20.0, 0.0)
    assert bench.lpe.nav_state().global_position_valid
    bench.run(3.0, vision(0.0, 0.0, 0.0), fix())
    assert bench.lpe.nav_state().origin.lat == pytest.approx(PLACE.lat, abs=1e-6)


# -- land and landing target ------------------------------------------------------------------


def test_standing_on_the_ground_is_measured_ten_times_a_second():
    bench = Bench()
    bench.lpe.push(LandedSample(START_US, landed=True))
    bench.run(5.0)
    assert 'land initialised' in bench.events
    assert bench.status('land').fused == pytest.approx(48, abs=2)
    assert bench.lpe.nav_state().local_position_valid
    assert bench.lpe.nav_state().in_air is False
    bench.lpe.push(LandedSample(bench.time_us, landed=False))
    bench.run(1.2)
    assert 'land timed out' in bench.events
    assert bench.lpe.nav_state().in_air


@pytest.mark.parametrize(('speed', 'believed'), [(0.9, True), (1.1, False)])
def test_landed_is_not_believed_while_the_fixes_travel(speed, believed):
    bench = Bench()
    bench.lpe.push(LandedSample(START_US, landed=True))
    bench.run(3.0, fix()).run(1.5, fix(velocity=np.array((0.0, speed, 0.0))))
    assert bench.sensor('land').timed_out != believed
    assert bench.lpe.nav_state().in_air != believed
    assert ('said to be landed while the fixes travel: not believed' in bench.events) != believed
    bench.run(1.5, fix())
    assert not bench.sensor('land').timed_out
    assert not bench.lpe.nav_state().in_air


def test_a_noisy_velocity_is_no_travel():
    bench = Bench()
    bench.lpe.push(LandedSample(START_US, landed=True))
    bench.run(3.0, fix(velocity=np.array((0.0, 1.4, 0.0)), sacc=0.5))
    assert not bench.sensor('land').timed_out
    assert not bench.lpe.nav_state().in_air


def test_a_landing_far_above_the_known_ground_is_a_fault():
    bench = Bench().run(5.0, baro(), distance(10.0))
    bench.lpe.push(LandedSample(START_US, landed=True))
    bench.run(1.0, baro(), distance(10.0))
    assert bench.sensor('land').faulty
    assert bench.lpe.filter.agl == pytest.approx(10.0, abs=0.2)


def test_the_landing_target_gives_velocity_from_its_first_sample():
    bench = Bench().run(0.05, target(0.0, 0.0))
    assert not bench.sensor('landing_target').timed_out
    bench.run(5.0, target(0.2, -0.1))
    assert bench.x[3:5] == pytest.approx((0.2, -0.1), abs=0.05)
    bench.run(0.05, target(9.0, 0.0))
    assert bench.sensor('landing_target').faulty
    bench.run(2.05)
    assert 'landing_target timed out' in bench.events


def test_the_target_has_a_least_variance():
    bench = Bench().run(1.0, target(0.0, 0.0, variance=0.0))
    assert bench.status('landing_target').innovation_variance[0] > 1e-4


# -- the mask, and numbers gone wrong ---------------------------------------------------------


def test_what_the_mask_leaves_out_is_counted():
    params = LpeParams()
    off = replace(params, gnss=replace(params.gnss, enabled=False),
                  baro=replace(params.baro, enabled=False))
    bench = Bench(off).run(3.0, fix(), baro(), vision(0.0, 0.0, 0.0), flow())
    assert bench.lpe.sensors.in_use() == []
    counts = bench.lpe.passed_over()
    assert counts[GnssSample] == {'not_enabled': 30}
    assert counts[BaroSample] == {'not_enabled': 150}
    assert counts[VisionSample] == {'not_enabled': 75}


@pytest.mark.parametrize('value', [math.nan, math.inf])
def test_a_state_that_is_not_finite_begins_again(value):
    bench = Bench().run(3.0, fix(), baro())
    bench.lpe.filter.x[4] = value
    bench.run(10.0, fix(), baro())
    assert np.isfinite(bench.x).all()
    assert bench.lpe.reset_counts()['state'] == 1
    assert any('state was not finite' in text for text in bench.events)


@pytest.mark.parametrize('value', [math.nan, -1.0])
def test_a_covariance_that_is_none_begins_again(value):
    bench = Bench().run(3.0, fix(), baro())
    bench.lpe.filter.P[3, 3] = value
    bench.run(10.0, fix(), baro())
    assert (bench.lpe.variances() > 0.0).all()
    assert bench.lpe.reset_counts()['covariance'] == 1
