"""The gyro against odometry and magnetic field: units, signs, silence are told, noise is not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import VisionSample
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import Flight
from ekf_fusion_ros.turn_check import TurnCheck

DT = 0.02
FIELD = np.array((0.2, 0.05, 0.43))
DEGREES = 180.0 / math.pi


def yawed(angle):
    return np.array((math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)))


def drive(change, *, by='odometry', seconds=60.0, swing=0.4, noise=0.0, bias=0.0, seed=3):
    """Return a check after a winding drive; `change` spoils the gyro's turn of a step in rad."""
    rng = np.random.default_rng(seed)
    check, before = TurnCheck(imu=True), 0.0
    for k in range(1, round(seconds / DT) + 1):
        time_us = round(1e6 * DT * k)
        yaw = swing * math.sin(0.5 * DT * k) + 0.1 * DT * k
        turned = np.array((0.0, 0.0, change(yaw - before)))
        before = yaw
        check.note_imu([ImuSample(time_us, turned + bias * DT, NAN3, DT, DT)])
        seen = yaw + noise * rng.standard_normal()
        if by == 'odometry':
            check.note_odometry(VisionSample(time_us, NAN3, yawed(seen)))
        else:
            c, s = math.cos(seen), math.sin(seen)
            body = np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0))) @ FIELD
            check.note_field(MagSample(time_us, body))
        if not check.open:
            break
    return check


@pytest.mark.parametrize('by', ['odometry', 'field'])
@pytest.mark.parametrize('bias', [0.0, 0.05])
def test_a_good_gyro_is_confirmed_whatever_its_bias(by, bias):
    check = drive(lambda turn: turn, by=by, bias=bias)
    assert not check.open
    assert check.sentence == ''


@pytest.mark.parametrize(('by', 'name'), [('odometry', 'the odometry'),
                                          ('field', 'the magnetic field')])
@pytest.mark.parametrize(('change', 'words'), [
    (lambda turn: turn * DEGREES, 'turns 57 times as far as'),
    (lambda turn: turn / DEGREES, 'turns 0.017 times as far as'),
    (lambda turn: -turn, 'turns the other way than'),
    (lambda turn: 0.0, 'does not turn'),
])
def test_a_gyro_that_cannot_be_right_is_told(by, name, change, words):
    check = drive(change, by=by)
    assert not check.open
    assert words in check.sentence
    assert name in check.sentence


@pytest.mark.parametrize('by', ['odometry', 'field'])
@pytest.mark.parametrize('change', [lambda turn: turn, lambda turn: turn * DEGREES])
def test_noise_at_rest_says_nothing(by, change):
    check = drive(change, by=by, swing=0.0, noise=0.03, seconds=200.0)
    assert check.sentence == ''


def test_noise_in_motion_hides_nothing():
    assert '57' in drive(lambda turn: turn * DEGREES, noise=0.02).sentence
    good = drive(lambda turn: turn, noise=0.02)
    assert not good.open
    assert good.sentence == ''


def test_a_turn_across_what_the_odometry_tells_is_no_fault():
    """Rocking that planar odometry does not see is no gyro in degrees."""
    rng = np.random.default_rng(8)
    check = TurnCheck(imu=True)
    for k in range(1, 6000):
        time_us = round(1e6 * DT * k)
        rocking = np.append(0.2 * rng.standard_normal(2), 0.0) * DT
        check.note_imu([ImuSample(time_us, rocking, NAN3, DT, DT)])
        check.note_odometry(VisionSample(time_us, NAN3, yawed(0.002 * rng.standard_normal())))
    assert check.sentence == ''


def test_after_a_pause_no_turn_is_compared():
    check = TurnCheck(imu=True)
    for k in range(200):
        time_us = 3_000_000 * k + 1
        check.note_imu([ImuSample(time_us, np.ones(3), NAN3, DT, DT)])
        check.note_odometry(VisionSample(time_us, NAN3, yawed(math.sin(k))))
    assert check.open


@pytest.mark.parametrize('roles', [
    ('imu', 'odometry', 'fix'), ('imu', 'fix', 'fix_velocity', 'magnetic_field')])
@pytest.mark.parametrize('in_degrees', [False, True])
def test_a_flight_warns_only_of_degrees(roles, in_degrees):
    flight = Scenario(
        trajectory=Flight(duration=60.0, height=15.0),
        sensors=default_sensors([role for role in roles if role != 'fix_velocity']), seed=1)
    session = FusionSession(Params(), list(roles))
    for arrival in flight.arrivals():
        sample = arrival.sample
        if in_degrees and isinstance(sample, ImuSample):
            sample = sample._replace(delta_angle=sample.delta_angle * DEGREES)
        session.push(sample)
    told = [event.text for event in session.drain_events() if 'the imu turns' in event.text]
    assert len(told) == in_degrees
    assert session.warnings() == told
    assert ('rad/s' in session.health().text) == in_degrees
