"""Navigation health through a session: roles in, status, events and home out."""

from __future__ import annotations

import numpy as np
import pytest

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.samples import ArmedSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.session import FusionSession

START = 1000.0


def session_of(estimator, *roles, **overrides):
    names = {name.replace('__', '.'): value for name, value in overrides.items()}
    return FusionSession(with_overrides(Params(), names), roles, estimator=estimator)


def run(session, build, first, last):
    for step in range(round(100 * first), round(100 * last)):
        session.handle('imu', build.imu(START + step / 100))


def test_home_is_set_and_told(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    run(session, build, 0.0, 1.0)
    assert session.navigation.home is None
    assert session.navigation_health().text.startswith('home not set: no GPS fix, for ')
    session.handle('fix', build.fix(START + 0.99))
    run(session, build, 1.0, 3.0)
    home = session.navigation.home
    assert (home.lat, home.lon, home.alt) == pytest.approx((47.0, 8.0, 500.0), abs=1e-9)
    texts = [event.text for event in session.drain_events()]
    assert 'home set: 47.0000000, 8.0000000, 500.00 m' in texts
    # The stand-in claims 1.4 m/s of velocity accuracy, which is too little.
    assert session.navigation_health().level is HealthLevel.WARN


def test_health_is_judged_ten_times_a_second(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    stamps = set()
    for step in range(200):
        session.handle('imu', build.imu(START + step / 100))
        stamps.add(session.navigation.time_us)
    # The first increment ends with the second message.
    rest = [round(1e6 * START) + 100_000 * n for n in range(1, 20)]
    assert sorted(stamps - {0}) == [round(1e6 * START) + 10_000, *rest]


def test_armed_is_counted_and_sets_home_again(build, estimator):
    session = session_of(estimator, 'imu', 'fix', 'armed', 'landed')
    session.handle('fix', build.fix(START))
    session.handle('landed', build.landed(True))
    run(session, build, 0.0, 3.0)
    first = session.navigation.home
    session.handle('armed', build.armed(True))
    session.handle('armed', build.armed('yes'))
    run(session, build, 3.0, 3.2)
    assert session.navigation.home.time_us > first.time_us
    counts = session.statistics()['armed']
    assert (counts.received, counts.accepted, counts.refused) == (2, 1, {'not_boolean': 1})
    assert not [sample for sample in estimator.samples if isinstance(sample, ArmedSample)]


def test_a_restart_keeps_home(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    session.handle('fix', build.fix(START))
    run(session, build, 0.0, 3.0)
    home = session.navigation.home
    session.reset()
    run(session, build, 4.0, 4.5)
    assert not session.navigation.global_position_valid
    assert session.navigation.home == home


def test_home_by_hand(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    assert not session.set_home(None)
    assert session.set_home(GeoPoint(46.5, 7.5, 100.0))
    run(session, build, 0.0, 3.0)
    assert session.navigation.home.manual
    assert session.navigation.home.lat == 46.5


def test_without_a_fix_home_is_not_missed(build, estimator):
    session = session_of(estimator, 'imu', 'odometry')
    run(session, build, 0.0, 3.0)
    assert 'home' not in session.navigation_health().text


def test_samples_without_roles_are_heard(estimator):
    session = FusionSession(Params(), estimator=estimator)
    session.push(ArmedSample(0, armed=True))
    for step in range(1, 300):
        session.push(ImuSample(10_000 * step, np.zeros(3), np.zeros(3), 0.01, 0.01))
    assert session.navigation.home is None
    assert session.navigation.time_us == 2_900_000
