"""Flags, test and home together on what an estimator says, and two flights from end to end."""

from __future__ import annotations

import math

from ekf2.bench import Bench
from health.stand_in import StandIn
import numpy as np
import pytest

from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.health.navigation_health import NavigationHealth
from ekf_fusion_ros.health.takeoff_test import Verdict
from ekf_fusion_ros.mathlib.rotation import matrix_from_euler_321
from ekf_fusion_ros.params.ekf2 import AidingParams
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.health import HealthParams
from ekf_fusion_ros.samples import GnssSample


def flags(status):
    return (status.global_position_valid, status.local_position_valid,
            status.local_velocity_valid)


def test_flags_go_by_their_own_accuracy_and_limit():
    one = StandIn(eph=4.9, evh=1.0)
    one.run(2.0)
    assert flags(one.status) == (True, True, False)
    one.evh = 0.999
    one.run(60.0)
    assert flags(one.status) == (True, True, True)
    one.eph = 12.6
    one.once()
    assert flags(one.status) == (False, False, True)
    assert one.told[-2:] == [
        'global position no longer valid: accuracy 12.6 m, limit 12.5 m',
        'local position no longer valid: accuracy 12.6 m, limit 12.5 m']


@pytest.mark.parametrize(('silent_us', 'expected'), [
    (900_000, True), (1_000_000, True), (1_100_000, False)])
def test_a_global_position_lives_for_the_time_out(silent_us, expected):
    """PX4 publishes none while the estimator has none, and judges the last one by its age."""
    one = StandIn()
    one.run(3.0)
    one.global_valid = False
    one.run(1e-6 * silent_us)
    assert flags(one.status) == (expected, True, True)


@pytest.mark.parametrize('change', [{'local_valid': False}])
def test_a_local_position_is_gone_at_once(change):
    one = StandIn()
    one.run(3.0)
    for name, value in change.items():
        setattr(one, name, value)
    one.once()
    assert flags(one.status) == (True, False, False)
    assert one.told[-1] == 'local velocity no longer valid: the estimator does not know it'


@pytest.mark.parametrize(('gap_us', 'expected'), [
    (999_999, True), (1_000_000, True), (1_000_001, False)])
def test_a_gap_of_the_stamps_longer_than_the_time_out_clears_all(gap_us, expected):
    one = StandIn()
    one.run(3.0)
    one.step_us = gap_us
    one.run(1e-6 * gap_us)
    assert flags(one.status) == (expected, expected, expected)


def test_dead_reckoning_is_as_bad_as_its_last_innovations():
    one = StandIn()
    one.run(3.0)
    one.dead_reckoning, one.innovation = True, 2.4
    one.once()
    assert one.status.accuracy.eph == one.status.accuracy.evh == 2.4
    assert flags(one.status) == (True, True, True)
    one.innovation = 2.6
    one.once()
    assert flags(one.status) == (True, True, False)


def test_probation_is_long_after_take_off():
    one = StandIn(armed=True)
    one.run(3.0)
    one.in_air = True
    one.run(5.0)
    one.eph = 20.0
    one.once()
    one.eph = 1.0
    # 30 s at take-off, 5 s of which have gone.
    one.run(24.5)
    assert not one.status.local_position_valid
    one.run(1.0)
    assert one.status.local_position_valid


def test_motion_that_is_only_inferred_is_no_take_off():
    one = StandIn(armed=None)
    one.run(3.0)
    one.in_air = True
    one.once()
    one.eph = 20.0
    one.once()
    one.eph = 1.0
    one.run(1.2)
    assert one.status.local_position_valid


def test_probation_is_short_on_the_ground():
    one = StandIn(armed=True)
    one.run(3.0)
    one.eph = 20.0
    one.once()
    one.eph = 1.0
    one.run(1.2)
    assert one.status.local_position_valid


def test_what_is_told_of_the_ground_beats_what_is_inferred():
    one = StandIn(armed=True, landed=True, in_air=True, ratio=2.0)
    one.run(5.0)
    assert one.status.takeoff_test is Verdict.OPEN
    one.landed = False
    one.run(1.2)
    assert one.status.takeoff_test is Verdict.FAILED


@pytest.mark.parametrize(('vehicle', 'switch', 'expected'), [
    ('multirotor', True, Verdict.FAILED), ('multirotor', False, Verdict.OPEN),
    ('fixed_wing', True, Verdict.OPEN), ('rover', True, Verdict.OPEN),
    ('unspecified', True, Verdict.OPEN)])
def test_the_take_off_test_is_for_multirotors_and_can_be_switched_off(vehicle, switch, expected):
    one = StandIn(HealthParams(takeoff_test=switch), vehicle, armed=True)
    one.run(3.0)
    one.in_air, one.ratio = True, 1.0
    one.run(5.0)
    assert one.status.takeoff_test is expected
    assert flags(one.status) == 3 * (expected is Verdict.OPEN,)


def test_a_failed_test_latches_all_flags_until_disarmed():
    one = StandIn(armed=True)
    one.run(3.0)
    one.in_air, one.ratio = True, 1.5
    one.run(1.0)
    assert flags(one.status) == (True, True, True)
    one.once()
    assert flags(one.status) == (False, False, False)
    one.ratio = 0.1
    one.run(60.0)
    one.in_air = False
    one.run(10.0)
    assert flags(one.status) == (False, False, False)
    report = one.health.health(expects_home=True)
    assert report.level is HealthLevel.ERROR
    assert report.text.startswith('navigation failed after take-off')
    one.armed = False
    one.run(1.0)
    assert flags(one.status) == (False, False, False)
    one.run(0.2)
    assert flags(one.status) == (True, True, True)


def test_without_an_armed_input_landing_forgets_a_failed_test():
    one = StandIn(armed=None)
    one.run(3.0)
    one.in_air, one.ratio = True, 1.5
    one.run(5.0)
    assert one.status.takeoff_test is Verdict.FAILED
    one.in_air = False
    one.run(2.0)
    assert one.status.takeoff_test is Verdict.OPEN
    assert flags(one.status) == (True, True, True)


def test_report_names_what_is_lacking():
    one = StandIn(global_valid=False, evh=1.5)
    one.run(3.0)
    report = one.health.health(expects_home=True, detail='waiting for the GNSS checks to pass')
    assert report.level is HealthLevel.WARN
    assert report.text == ('home not set: no GPS fix, for 3 s (waiting for the GNSS checks to '
                           'pass)')
    assert report.values['global_position_valid'] == 'false'
    assert one.health.health(expects_home=False).text == (
        'local velocity not valid: accuracy 1.5 m/s, limit 1.0 m/s, for 3 s')
    one.evh = 0.1
    one.run(0.5)
    assert 'must be good for ' in one.health.health(expects_home=False).text
    one.run(60.0)
    report = one.health.health(expects_home=False)
    assert (report.level, report.text) == (HealthLevel.OK, 'local position and velocity valid')


def test_the_estimate_is_never_touched():
    """The stand-in has no method that changes it; a state cannot be written to by health."""
    one = StandIn(armed=True)
    nav = one.nav_state()
    for array in (nav.position, nav.velocity, nav.pose_cov, nav.velocity_cov, nav.quaternion):
        array.flags.writeable = False
    one.nav_state = lambda: nav
    one.run(3.0)
    assert flags(one.status) == (True, True, True)


class Flight:
    """A filter on the bench and the health of what it says, judged ten times a second."""

    def __init__(self, **attitude):
        params = Ekf2Params(aiding=AidingParams(vehicle='multirotor'))
        self.bench = Bench(params, **attitude)
        self.health = NavigationHealth(HealthParams(), 'multirotor', 'wgs84')
        self.armed, self.landed, self.told = False, True, []

    def run(self, seconds, move=lambda: None):
        for _ in range(round(10 * seconds)):
            bench = self.bench
            move()
            bench.run(0.1)
            fix = bench.fix
            newest = GnssSample(
                bench.now_us, fix.lat, fix.lon, fix.alt, fix.eph, fix.epv) \
                if 'fix' in bench.sending else None
            self.health.step(
                bench.now_us, bench.ekf, landed=self.landed, armed=self.armed, fix=newest)
            self.told += [event.text for event in self.health.drain_events()]

    @property
    def status(self):
        return self.health.status

    @property
    def sentence(self):
        return self.health.health(expects_home=True).text


def test_a_normal_start():
    flight = Flight()

    flight.run(10.0)
    assert flight.sentence == 'home not set: no GPS fix, for 10 s; no valid local position, ' \
        'for 10 s'

    flight.bench.sending.add('fix')
    flight.bench.fix.eph = 6.2
    flight.run(12.1)
    assert flight.sentence.startswith('home not set: GPS accuracy 6.2 m, limit 5.0 m, for 12 s')
    assert flags(flight.status) == (False, False, False)

    flight.bench.fix.eph = 0.9
    flight.run(5.0)
    # The estimator wants ten seconds of good fixes.
    assert flight.sentence.startswith('home not set: no valid global position, for 5 s')

    flight.run(10.0)
    assert flags(flight.status) == (True, True, True)
    home, fix = flight.status.home, flight.bench.fix
    assert (home.lat, home.lon) == pytest.approx((fix.lat, fix.lon), abs=1e-5)
    assert home.alt == pytest.approx(fix.alt, abs=1.0)
    assert [text.split(':')[0] for text in flight.told] == [
        'global position valid', 'local position valid', 'local velocity valid', 'home set']


def test_a_failed_yaw_at_take_off():
    """The compass sits turned by half a turn: the estimate goes south while the fixes go north."""
    flight = Flight()
    bench = flight.bench
    bench.field = matrix_from_euler_321(0.0, 0.0, math.radians(180.0)) @ bench.field
    bench.sending.add('fix')
    flight.run(20.0)
    assert flags(flight.status) == (True, True, True)

    flight.armed = True
    flight.run(1.0)
    flight.landed = False
    bench.fly()
    flight.told.clear()
    at_rest = bench.force
    bench.force = at_rest + np.array((2.0, 0.0, 0.0))

    def go():
        bench.fix.velocity = bench.fix.velocity + np.array((0.2, 0.0, 0.0))
        bench.fix.lat += 0.1 * bench.fix.velocity[0] / 111_180.0

    flight.run(2.4, go)
    assert flight.status.takeoff_test is Verdict.FAILED
    assert flags(flight.status) == (False, False, False)
    assert [text.split(':')[0] for text in flight.told] == [
        'home set again', 'navigation failed after take-off', 'global position no longer valid',
        'local position no longer valid', 'local velocity no longer valid']

    # The estimator finds its yaw; the verdict stands until the vehicle is disarmed.
    bench.force, bench.fix.velocity = at_rest, np.zeros(3)
    flight.run(20.0)
    assert flags(flight.status) == (False, False, False)
    flight.landed, flight.armed = True, False
    flight.run(2.0)
    assert flight.status.takeoff_test is Verdict.OPEN
