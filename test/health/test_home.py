"""Home: when it is set, kept, set again, and what is said while it is not."""

from __future__ import annotations

import math

from health.stand_in import ORIGIN
from health.stand_in import START_US
from health.stand_in import StandIn
import pytest

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.health.status import NavigationStatus
from ekf_fusion_ros.params.health import HealthParams

pymap3d = pytest.importorskip('pymap3d')


def test_home_holds_the_place_on_earth_and_in_the_local_frame():
    one = StandIn(north=30.0, east=-20.0, down=-7.0, yaw=1.25)
    one.run(2.0)
    lat, lon, alt = pymap3d.ned2geodetic(30.0, -20.0, -7.0, 47.0, 8.0, 400.0)
    home = one.home
    assert (home.lat, home.lon) == pytest.approx((lat, lon), abs=1e-9)
    # The height of the filter is along the vertical, the one of the oracle above a tangent plane.
    assert home.alt == pytest.approx(alt, abs=1e-3)
    assert (home.x, home.y, home.z, home.yaw) == pytest.approx((30.0, -20.0, -7.0, 1.25))
    assert not home.manual
    assert home.time_us - START_US == 1_200_000


@pytest.mark.parametrize(('eph', 'epv', 'expected'), [
    (2.9999, 7.9999, True), (3.0, 8.0, True), (3.0001, 1.0, False), (1.0, 8.0001, False)])
def test_set_up_to_both_limits(eph, epv, expected):
    one = StandIn(HealthParams(home_eph=3.0, home_epv=8.0), eph=eph, epv=epv)
    one.run(2.0)
    assert (one.home is not None) is expected


@pytest.mark.parametrize('change', [
    {'global_valid': False}, {'local_valid': False}, {'eph': 5.1}, {'epv': 10.1},
    {'origin': None}, {'started': False}, {'armed': True}])
def test_not_set_while_something_is_missing(change):
    one = StandIn(**change)
    one.run(5.0)
    assert one.home is None
    assert one.status.home_text.startswith('home not set: ')


def test_what_is_missing_is_said_with_its_time():
    one = StandIn(eph=6.2, epv=11.0)
    one.health.step(one.now_us, one, armed=False)
    one.eph, one.epv = 1.0, 11.0
    one.run(12.0)
    assert one.status.home_text == 'home not set: height accuracy 11.0 m, limit 10.0 m, for 11 s'
    one.eph = 5.5
    one.run(3.0)
    assert one.status.home_text == (
        'home not set: position accuracy 5.5 m, limit 5.0 m, for 3 s; height accuracy 11.0 m, '
        'limit 10.0 m, for 14 s')


def test_the_receiver_is_named_where_it_is_the_reason():
    one = StandIn(global_valid=False)
    one.run(2.0)
    assert 'no GPS fix, for 2 s' in one.status.home_text
    one.run(12.1, fixes_of=6.2)
    assert one.status.home_text == 'home not set: GPS accuracy 6.2 m, limit 5.0 m, for 12 s'
    one.hear(1.0, epv=10.1)
    one.once()
    assert 'GPS height accuracy 10.1 m, limit 10.0 m' in one.status.home_text
    one.run(1.0, fixes_of=1.0)
    assert 'no valid global position, for 1 s' in one.status.home_text


@pytest.mark.parametrize(('age_us', 'expected'), [
    (2_900_000, 'GPS accuracy'), (3_000_000, 'GPS accuracy'), (3_100_000, 'no GPS fix')])
def test_an_old_fix_is_none(age_us, expected):
    one = StandIn(global_valid=False)
    one.hear(6.2)
    one.run(1e-6 * age_us)
    assert expected in one.status.home_text


def test_set_again_on_arming():
    one = StandIn()
    one.run(2.0)
    one.north = 1.5
    one.run(2.0)
    assert one.home.x == 0.0
    one.armed = True
    one.run(1.0)
    assert one.home.x == 1.5
    one.north = 1.6
    one.run(1.0)
    assert one.home.x == 1.5
    assert one.told[-1].startswith('home set again: ')


def test_set_again_on_take_off_and_not_after_it():
    one = StandIn()
    one.run(2.0)
    one.armed = True
    one.run(2.0)
    one.in_air, one.down = True, -0.5
    one.once()
    assert one.home.z == -0.5
    one.down = -30.0
    one.run(10.0)
    assert one.home.z == -0.5


def test_kept_in_flight_and_through_a_landing_until_disarmed():
    one = StandIn()
    one.run(2.0)
    one.armed = True
    one.once()
    one.in_air = True
    one.once()
    before = one.home
    one.north = 90.0
    one.run(5.0)
    one.in_air = False
    one.run(5.0)
    assert one.home == before
    one.armed = False
    one.once()
    assert one.home.x == 90.0


@pytest.mark.parametrize(('moved', 'lifted', 'expected'), [
    (1.999, 0.0, False), (2.0, 0.0, False), (2.001, 0.0, True),
    (0.0, 3.999, False), (0.0, 4.0, False), (0.0, 4.001, True)])
def test_a_landed_vehicle_is_moved_from_two_accuracies_on(moved, lifted, expected):
    """Accuracies: 1 m horizontal, 2 m vertical."""
    one = StandIn()
    one.run(2.0)
    one.east, one.down = moved, -lifted
    one.once()
    assert (one.home.y == moved and one.home.z == -lifted) is expected


def test_a_disarmed_vehicle_in_the_air_keeps_home():
    one = StandIn()
    one.run(2.0)
    one.in_air, one.north = True, 50.0
    one.run(2.0)
    assert one.home.x == 0.0


def test_a_restart_of_the_estimator_keeps_home():
    one = StandIn()
    one.run(2.0)
    before = one.home
    one.health.restart()
    one.yaw_jump = 1.0
    one.now_us += 3_600_000_000
    one.run(0.5)
    assert not one.status.global_position_valid
    one.run(5.0)
    assert one.status.global_position_valid
    assert one.home == before


def test_without_an_armed_input_home_is_set_once():
    one = StandIn(armed=None)
    one.run(2.0)
    one.north, one.in_air = 70.0, True
    one.run(2.0)
    one.in_air = False
    one.run(2.0)
    assert one.home.x == 0.0


def test_by_hand_nothing_moves_it_until_it_follows_the_rules_again():
    one = StandIn()
    one.run(2.0)
    point = GeoPoint(47.001, 8.002, 410.0)
    assert one.health.set_home(point)
    north, east, _ = pymap3d.geodetic2ned(47.001, 8.002, 400.0, 47.0, 8.0, 400.0)
    assert one.home.manual
    assert (one.home.x, one.home.y) == pytest.approx((north, east), abs=0.02)
    assert one.home.z == -10.0
    one.armed, one.in_air = True, True
    one.run(2.0)
    one.armed, one.in_air = False, False
    one.run(2.0)
    assert one.home.lat == 47.001
    assert one.status.home_text.startswith('home set by hand: 47.0010000, 8.0020000')
    one.north = 3.0
    assert one.health.set_home(None)
    assert not one.home.manual
    # The present place is that of the latest judgement.
    assert one.home.x == 0.0


@pytest.mark.parametrize('point', [
    GeoPoint(91.0, 8.0, 1.0), GeoPoint(47.0, 181.0, 1.0), GeoPoint(47.0, 8.0, math.nan)])
def test_a_point_off_the_earth_is_refused(point):
    one = StandIn()
    one.run(2.0)
    before = one.home
    assert not one.health.set_home(point)
    assert one.home == before


def test_the_present_place_is_refused_where_it_is_not_known():
    one = StandIn(global_valid=False)
    assert not one.health.set_home(None)
    one.run(3.0)
    assert not one.health.set_home(None)
    assert one.home is None


def test_by_hand_before_there_is_an_origin():
    one = StandIn(started=False)
    assert one.health.set_home(GeoPoint(47.0, 8.0, 390.0))
    assert math.isnan(one.home.x)
    one.started = True
    one.once()
    assert (one.home.x, one.home.y, one.home.z) == pytest.approx((0.0, 0.0, 10.0), abs=1e-6)


def test_the_place_on_earth_stays_when_the_origin_moves():
    one = StandIn()
    one.run(2.0)
    one.origin = GeoPoint(47.0, 8.0, 350.0)
    one.down = -50.0
    one.once()
    assert (one.home.lat, one.home.lon, one.home.alt) == pytest.approx((47.0, 8.0, 400.0))
    assert one.home.z == -50.0


def test_yaw_of_home_turns_with_a_reset_of_yaw():
    one = StandIn(yaw=3.0)
    one.run(2.0)
    one.yaw_jump = 0.5
    one.once()
    assert one.home.yaw == pytest.approx(3.5 - 2.0 * math.pi)


def test_ready_to_arm_by_the_parameter():
    strict = StandIn(HealthParams(arm_without_gps=False), global_valid=False)
    loose = StandIn(global_valid=False)
    for one in (strict, loose):
        one.run(3.0)
    assert not strict.status.ready
    assert loose.status.ready
    strict.armed = True
    strict.once()
    assert strict.told[-1].startswith(
        'armed though health.arm_without_gps is off: home not set: no GPS fix')
    strict.armed, strict.global_valid = False, True
    strict.run(3.0)
    assert strict.status.ready
    assert ORIGIN.lat == strict.home.lat


def test_before_the_first_judgement_home_waits_for_an_estimate():
    assert NavigationStatus().home_text == 'home not set: there is no estimate yet'
