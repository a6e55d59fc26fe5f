"""Messages that come late count at their stamp while the horizon can wait, later by reason."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.roles import age_limit_us
from ekf_fusion_ros.roles import configure
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.surroundings import Wind
from ekf_fusion_ros.simulation.trajectory import Flight

BASE = ('imu', 'magnetic_field', 'pressure', 'landed')
ON_BOARD = {
    'range': (*BASE, 'range', 'flow'), 'flow': (*BASE, 'range', 'flow'),
    'airspeed': (*BASE, 'fix', 'airspeed'), 'aux_velocity': (*BASE, 'fix', 'aux_velocity'),
    'fix': (*BASE, 'fix', 'gps_heading')}
AID_OF = {'range': 'height_above_ground', 'flow': 'optical_flow', 'airspeed': 'airspeed',
          'aux_velocity': 'auxiliary_velocity', 'fix': 'gnss_position'}

# In ms: the horizon, and what delay and hold leave of it.
HORIZON, HOLD = 200.0, 20.0
DELAY = {'range': 5.0, 'flow': 5.0, 'airspeed': 100.0, 'aux_velocity': 5.0, 'fix': 110.0}


@cache
def flown(role, latency):
    """Return a session after a flight on which one role came late by a latency in s."""
    sensors = default_sensors(ON_BOARD[role])
    sensors[role] = replace(sensors[role], latency=latency)
    flight = Flight(duration=40.0, height=8.0, wind=Wind(mean=(4.0, -3.0, 0.0)))
    scenario = Scenario(trajectory=flight, sensors=sensors, seed=11)
    # Samples of the receiver hold its yaw already, no message is to join them.
    params = with_overrides(
        Params(), {'ekf2.gnss.checks.health_time': 2.0, 'ekf2.gnss.yaw': role == 'fix'})
    session = FusionSession(params, [one for one in ON_BOARD[role] if one != 'gps_heading'])
    for arrival in scenario.arrivals():
        session.push(arrival.sample)
    session.finish()
    return session


def fused(session):
    return {status.name: status.fused for status in session.estimator.aid_statuses()}


def counts(session, role):
    statistics = session.statistics()[role]
    return statistics.accepted, dict(statistics.refused)


@pytest.mark.parametrize('share', [
    pytest.param(0.35, marks=pytest.mark.slow), pytest.param(0.7, marks=pytest.mark.slow), 1.0])
@pytest.mark.parametrize('role', ON_BOARD)
def test_late_within_the_horizon_is_as_good_as_in_time(role, share):
    prompt = flown(role, 0.0)
    late = flown(role, 1e-3 * share * (HORIZON - HOLD - DELAY[role] - 15.0))
    assert 'too_old' not in counts(late, role)[1]
    assert fused(prompt)[AID_OF[role]] > 20
    assert prompt.estimator.filter.flags.gps_yaw == (role == 'fix')
    assert fused(late) == fused(prompt)
    # The receiver is checked on arrival, so that the first fix may find another state.
    tolerance = 1e-6 if role == 'fix' else 0.0
    for name in ('x', 'rot'):
        np.testing.assert_allclose(
            getattr(late.estimator.filter, name), getattr(prompt.estimator.filter, name),
            rtol=0.0, atol=tolerance)


@pytest.mark.parametrize('role', ON_BOARD)
def test_later_than_the_horizon_can_take_is_refused_by_reason(role):
    params = configure(Params(), ON_BOARD[role])
    limit_us = age_limit_us(params, role)
    late = flown(role, 1e-6 * limit_us + 0.02)
    accepted, refused = counts(late, role)
    assert accepted < 10
    assert refused['too_old'] > 100
    assert fused(late).get(AID_OF[role], 0) == 0
    assert not late.estimator.filter.flags.gps_yaw


@pytest.mark.parametrize('part', ['fix_velocity', 'gps_heading'])
def test_a_fix_whose_partner_never_comes_is_fused_all_the_same(part):
    sensors = default_sensors((*BASE, 'fix'))
    scenario = Scenario(trajectory=Flight(duration=40.0, height=8.0), sensors=sensors, seed=11)
    params = with_overrides(Params(), {'ekf2.gnss.checks.health_time': 2.0})
    session = FusionSession(params, (*BASE, 'fix', part))
    for arrival in scenario.arrivals():
        session.push(arrival.sample)
    assert fused(session)['gnss_position'] > 100


@pytest.mark.parametrize(('latency', 'told'), [(0.0, False), (3.0, True)])
def test_a_topic_that_is_nearly_all_refused_is_named_with_the_reason(latency, told):
    sensors = default_sensors(('imu', 'odometry', 'fix'))
    sensors['odometry'] = replace(sensors['odometry'], latency=latency)
    scenario = Scenario(
        trajectory=Flight(duration=30.0, height=8.0), sensors=sensors, seed=11)
    session = FusionSession(Params(), ['imu', 'odometry', 'fix'])
    for arrival in scenario.arrivals():
        session.push(arrival.sample)
    text = session.health().text
    assert ('messages are refused, the last one as too_old' in text) == told
    assert any(one.startswith('odometry: ') for one in session.warnings()) == told
