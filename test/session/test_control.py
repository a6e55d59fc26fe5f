"""What an operator does to a running session: reset, origin, pose."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.estimator import AidStatus
from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import GivenPose
from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.map_origin import map_of_point
from ekf_fusion_ros.map_origin import point_of_map
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.session import FusionSession

START = 1000.0
DATUM = GeoPoint(46.99, 8.01, 450.0)
FIXED = {'session.origin_from': 'parameter', 'session.origin': (46.99, 8.01, 450.0)}
POSE = GivenPose(np.zeros(3), np.ones(3), 0.0, 0.0)


def session_of(estimator, roles=('imu', 'fix'), **overrides):
    return FusionSession(with_overrides(Params(), overrides), roles, estimator=estimator)


def drive(session, build, first, last, lat=47.0):
    """Push a fix and inertial messages over [first, last]; return the outputs."""
    outputs = session.handle('fix', build.fix(first, lat)) if 'fix' in session.roles else []
    for step in range(round(first * 100), round(last * 100) + 1):
        outputs += session.handle('imu', build.imu(step / 100))
    return outputs


def texts(session):
    return [event.text for event in session.drain_events()]


def test_a_fixed_origin_holds_from_the_first_output(build, estimator):
    outputs = drive(session_of(estimator, **FIXED), build, START, START + 1)
    assert outputs
    assert {output.nav.origin for output in outputs} == {DATUM}


def test_a_fixed_origin_that_is_not_on_the_earth_is_refused(estimator):
    with pytest.raises(ValueError, match=r'session\.origin'):
        session_of(estimator, **{**FIXED, 'session.origin': (91.0, 0.0, 0.0)})


def test_a_fixed_origin_that_is_not_given_is_refused(estimator):
    with pytest.raises(ValueError, match=r'session\.origin_from = .* session\.origin too'):
        session_of(estimator, **{'session.origin_from': 'parameter'})


def test_an_origin_set_before_the_first_fix_waits_for_it(build, estimator):
    session = session_of(estimator)
    assert session.set_origin(DATUM)
    assert not session.set_origin(GeoPoint(47.0, 181.0, 0.0))
    outputs = drive(session, build, START, START + 1)
    assert {output.nav.origin for output in outputs} == {DATUM}


def test_an_origin_set_in_flight_moves_the_map(build, estimator):
    session = session_of(estimator)
    drive(session, build, START, START + 1)
    assert session.set_origin(DATUM)
    outputs = drive(session, build, START + 1.01, START + 2)
    assert {output.nav.origin for output in outputs} == {DATUM}


@pytest.mark.parametrize('first', [0.0, 1.0])
def test_an_origin_whose_altitude_is_left_open_keeps_the_one_of_the_map(build, estimator, first):
    session = session_of(estimator)
    if first:
        drive(session, build, START, START + first)
    assert session.set_origin(GeoPoint(46.99, 8.01, math.nan))
    assert not session.set_origin(GeoPoint(math.nan, 8.01, math.nan))
    outputs = drive(session, build, START + first + 0.01, START + 2)
    assert {output.nav.origin for output in outputs} == {GeoPoint(46.99, 8.01, 500.0)}


@pytest.mark.parametrize(('keep', 'lat', 'words'), [
    (True, 47.0, 'stays'), (False, 47.001, 'is set anew')])
def test_reset_is_announced_counted_and_keeps_the_origin_or_not(
    build, estimator, keep, lat, words,
):
    session = session_of(estimator)
    drive(session, build, START, START + 1)
    session.reset(keep_origin=keep)
    assert any(f'on request, the origin of the map {words}' in text for text in texts(session))
    assert session.resets()['restarts'] == 1
    outputs = drive(session, build, START + 1.01, START + 2, lat=47.001)
    assert outputs[-1].nav.origin.lat == lat


def test_reset_returns_to_the_fixed_origin(build, estimator):
    session = session_of(estimator, **FIXED)
    drive(session, build, START, START + 1)
    session.set_origin(GeoPoint(47.0, 8.0, 0.0))
    session.reset(keep_origin=False)
    assert drive(session, build, START + 1.01, START + 2)[-1].nav.origin == DATUM


def test_a_pose_waits_for_a_map(build, estimator):
    session = session_of(estimator)
    assert not session.set_pose(POSE)
    session.handle('imu', build.imu(START))
    assert not session.set_pose(POSE)
    drive(session, build, START + 0.01, START + 1)
    assert session.set_pose(POSE)
    assert estimator.poses == [POSE]


def test_without_a_fix_the_local_frame_takes_a_pose(build, estimator):
    session = session_of(estimator, ('imu', 'odometry'))
    drive(session, build, START, START + 1)
    assert session.set_pose(POSE)


def drive_two_topics(session, build, first, last, speed):
    """Drive east over [first, last] in s at a speed in m/s; the odometry's x axis is east."""
    outputs = []
    for step in range(round(10 * first), round(10 * last)):
        x = speed * (0.1 * step - first)
        message = build.odometry(START + 0.1 * step, x)
        message.twist.twist.linear.x = speed
        outputs += session.handle('odometry', message)
        if step % 2 == 0:
            fix = build.fix(START + 0.1 * step)
            fix.longitude += x / 76056.0
            outputs += session.handle('fix', fix)
    return outputs


@pytest.mark.parametrize(('yaw', 'sigma', 'stays'), [
    (0.1, 0.05, True), (0.1, 1.0, False), (1.5, 0.05, False)])
def test_a_given_heading_stays_until_motion_knows_better(build, yaw, sigma, stays):
    """The vehicle looks east, NED yaw 90 deg; it is told to look `yaw` rad farther right."""
    session = session_of(None, ('odometry', 'fix'))
    drive_two_topics(session, build, 0.0, 20.0, 0.0)
    given = GivenPose(np.zeros(3), np.zeros(3), 0.5 * np.pi + yaw, sigma ** 2)
    assert session.set_pose(given)
    told = texts(session)
    assert 'pose set on request' in told
    assert not any('yaw aligned by matching' in text for text in told)
    outputs = drive_two_topics(session, build, 20.0, 40.0, 1.0)
    assert outputs
    assert any('yaw aligned by matching' in text for text in texts(session)) is not stays


def test_adopted_parameters_reach_decoders_and_estimator(build, estimator):
    session = session_of(estimator)
    drive(session, build, START, START + 1)
    session.adopt(with_overrides(Params(), {
        'messages.fix.min_eph': 3.0, 'ekf2.gnss.pos_gate': 4.0}))
    drive(session, build, START + 1.01, START + 2)
    assert [fix.eph for fix in estimator.of(GnssSample)] == [1.0, 3.0]
    assert estimator.params.gnss.pos_gate == 4.0
    # What the roles have chosen stays chosen.
    assert estimator.params.mag.type == 'none'


@pytest.mark.parametrize('projection', ['wgs84', 'sphere'])
def test_points_of_the_map_and_of_the_earth(projection):
    """A hundredth of a degree of latitude is 1112 m; the way back ends where it began."""
    x, y, z = map_of_point(GeoPoint(47.0, 8.01, 470.0), DATUM, projection)
    assert (x, y, z) == pytest.approx((0.0, 1112.0, 20.0), abs=1.0)
    point = point_of_map(300.0, -400.0, 5.0, DATUM, projection)
    plane = make_projection(projection, DATUM.lat, DATUM.lon, DATUM.alt)
    assert plane.project(point.lat, point.lon) == pytest.approx((-400.0, 300.0), abs=1e-3)
    assert map_of_point(point, DATUM, projection) == pytest.approx((300.0, -400.0, 5.0), abs=1e-3)


def test_what_is_off_the_map_is_refused():
    with pytest.raises(ValueError, match='not a point of the earth'):
        map_of_point(GeoPoint(95.0, 0.0, 0.0), DATUM, 'wgs84')
    with pytest.raises(ValueError, match='farther than'):
        map_of_point(GeoPoint(-46.0, -170.0, 0.0), DATUM, 'wgs84')
    with pytest.raises(ValueError, match='farther than'):
        point_of_map(float('nan'), 0.0, 0.0, DATUM, 'wgs84')


def aid(name, fused, first_us, last_us, active=True):
    return AidStatus(name, active, last_us, (0.0,), (0.0,), 0.0, False, fused, 1, first_us,
                     last_us, 1, 0)


def test_counts_of_the_aiding_go_on_over_restarts(estimator, monkeypatch):
    session = session_of(estimator)
    found = [[aid('gnss_position', 3, 10, 30), aid('yaw', 4, 10, 20)],
             [aid('gnss_position', 5, 50, 70)], [aid('gnss_position', 0, 0, 0, active=False)]]
    monkeypatch.setattr(estimator, 'aid_statuses', lambda: found[0])
    for _ in range(2):
        session.reset()
        del found[0]
    fix, yaw = session.aid_statuses()
    assert (fix.fused, fix.rejected, fix.starts) == (8, 3, 3)
    assert (fix.first_fused_us, fix.last_fused_us, fix.active) == (10, 70, False)
    assert (yaw.fused, yaw.rejected, yaw.last_fused_us, yaw.active) == (4, 1, 20, False)
