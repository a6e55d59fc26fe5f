"""IMU and odometry against each other: who sits turned is told, tilt and motion are not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.down_check import DownCheck
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import NAN4
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import VisionSample
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import Flight

DT = 0.01


def rolled(angle, time_us=0):
    """Odometry of a body rolled to the right."""
    return VisionSample(time_us, NAN3, np.array(
        (math.cos(0.5 * angle), math.sin(0.5 * angle), 0.0, 0.0)))


def at_rest(roll, seconds):
    """Increments of an IMU at rest in a body rolled to the right: up lies to the left then."""
    force = 9.81 * np.array((0.0, -math.sin(roll), -math.cos(roll)))
    return [ImuSample(round(1e6 * DT * k), np.zeros(3), force * DT, DT, DT)
            for k in range(1, round(seconds / DT) + 1)]


@pytest.mark.parametrize(('imu', 'odometry', 'degrees'), [
    (0.5 * math.pi, 0.0, 90), (math.pi, 0.0, 180), (0.0, -0.6, 34)])
def test_a_sensor_that_sits_turned_is_told_once(imu, odometry, degrees):
    check = DownCheck(imu=True)
    check.note_odometry(rolled(odometry))
    assert not check.note_imu(at_rest(imu, 9.9))
    assert check.note_imu(at_rest(imu, 0.2))
    assert f'{degrees} deg apart' in check.sentence
    assert 'messages.imu.mount_rpy' in check.sentence
    assert not check.open


@pytest.mark.parametrize(('imu', 'odometry'), [(0.0, 0.0), (1.2, 1.2), (0.4, 0.0)])
def test_a_tilted_body_is_no_turned_sensor(imu, odometry):
    check = DownCheck(imu=True)
    check.note_odometry(rolled(odometry))
    assert not check.note_imu(at_rest(imu, 10.1))
    assert not check.open
    assert check.sentence == ''


def test_odometry_without_attitude_says_nothing():
    check = DownCheck(imu=True)
    check.note_odometry(VisionSample(0, NAN3, NAN4))
    assert not check.note_imu(at_rest(1.5, 10.1))
    assert check.sentence == ''


@pytest.mark.parametrize(('roll', 'told'), [
    (0.0, False), (1.5, False), (2.0, False), (3.0, True), (-3.0, True)])
def test_without_an_attitude_only_a_vehicle_upside_down_is_told(roll, told):
    check = DownCheck(imu=True)
    assert check.note_imu(at_rest(roll, 10.1)) == told
    assert ('upside down' in check.sentence) == told


@pytest.mark.parametrize('states_attitude', [False, True])
@pytest.mark.parametrize(('share', 'words'), [
    (1.0 / 9.81, 'feels 1.0 m/s^2'), (0.0, 'feels 0.0 m/s^2'), (9.81, 'feels 96.2 m/s^2')])
def test_a_specific_force_that_is_not_gravity_is_told(share, words, states_attitude):
    check = DownCheck(imu=True)
    if states_attitude:
        check.note_odometry(rolled(0.0))
    assert check.note_imu([
        imu._replace(delta_velocity=share * imu.delta_velocity) for imu in at_rest(0.0, 10.1)])
    assert words in check.sentence


def flown(change):
    """Return a session after a flight whose IMU samples were changed."""
    roles = ('odometry', 'fix', 'imu')
    flight = Scenario(
        trajectory=Flight(duration=25.0, height=15.0), sensors=default_sensors(roles), seed=1)
    session = FusionSession(Params(), list(roles))
    for arrival in flight.arrivals():
        sample = arrival.sample
        session.push(change(sample) if isinstance(sample, ImuSample) else sample)
    return session


def test_without_gravity_the_reason_is_told_not_what_comes_later():
    """Nothing starts then; to drive on would not help."""
    session = flown(lambda imu: imu._replace(delta_velocity=imu.delta_velocity / 9.81))
    text = session.health().text
    assert text.startswith('gathering samples for the initial alignment')
    assert 'the specific force is 1.0 m/s^2' in text
    assert 'yaw' not in text


@pytest.mark.parametrize('turned', [False, True])
def test_a_flight_warns_only_with_a_turned_imu(turned):
    session = flown(lambda imu: imu._replace(
        delta_angle=imu.delta_angle[[0, 2, 1]],
        delta_velocity=imu.delta_velocity[[0, 2, 1]]) if turned else imu)
    told = [event.text for event in session.drain_events() if 'deg apart' in event.text]
    assert len(told) == turned
    assert session.warnings() == told
    assert ('deg apart' in session.health().text) == turned
