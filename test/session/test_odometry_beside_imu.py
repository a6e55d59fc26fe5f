"""Odometry with slip beside an IMU: the estimate is no surer of its place than it should be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import NAN4
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import Flight
from ekf_fusion_ros.simulation.vision import Vision

pymap3d = pytest.importorskip('pymap3d')

ROLES = ('odometry', 'fix', 'imu')
SETTLED, OUTAGE = 60.0, (90.0, 110.0)
FLIGHTS = 4


def flown(scale, seed):
    """Return time (N,), errors NE (N, 2) in m and their covariance (N, 2, 2)."""
    sensors = default_sensors(ROLES)
    sensors['odometry'] = Vision(scale=scale, yaw_walk=0.2 * scale)
    sensors['fix'] = replace(sensors['fix'], outages=(OUTAGE,))
    flight = Scenario(trajectory=Flight(duration=130.0, height=15.0), sensors=sensors, seed=seed)
    session, rows, covariances = FusionSession(Params(), list(ROLES)), [], []
    for arrival in flight.arrivals():
        for output in session.push(arrival.sample):
            nav = output.nav
            east, north, _ = pymap3d.geodetic2enu(
                nav.origin.lat, nav.origin.lon, nav.origin.alt,
                flight.origin.lat, flight.origin.lon, flight.origin.alt)
            rows.append((nav.time_us, nav.position[0] + north, nav.position[1] + east))
            covariances.append(nav.pose_cov[0:2, 0:2])
    table = np.array(rows)
    time = 1e-6 * (table[:, 0] - flight.start_us)
    truth = flight.trajectory.motion(time).position[:, 0:2]
    return time, table[:, 1:] - truth, np.array(covariances)


@pytest.mark.slow
@pytest.mark.parametrize('scale', [0.0, 0.05])
def test_errors_are_of_the_size_that_is_stated(scale):
    nees, squares = [], []
    for seed in range(1, FLIGHTS + 1):
        time, error, covariance = flown(scale, seed)
        settled = time > SETTLED
        each = np.einsum('ni,nij,nj->n', error, np.linalg.inv(covariance), error)
        nees.append(each[settled].mean())
        squares.append((error[settled & (time < OUTAGE[0])] ** 2).sum(axis=1).mean())
    # 2 in the mean where the covariance is right; 55 and 350 where both errors are taken for
    # white noise. Errors of a flight hang together, so that each mean is about a single draw from
    # chi-square of two degrees of freedom: 95 % of the means of four lie below this.
    assert np.mean(nees) < 3.88
    # the fixes err by 1.3 m along each axis
    assert np.sqrt(np.mean(squares)) < 1.84


@pytest.mark.parametrize(('roles', 'told'), [(ROLES, True), ((*ROLES, 'magnetic_field'), False)])
def test_a_yaw_that_nothing_tells_is_named(roles, told):
    sensors = default_sensors(roles)
    sensors['fix'] = replace(sensors['fix'], has_velocity=False)
    flight = Scenario(trajectory=Flight(duration=40.0, height=15.0), sensors=sensors, seed=1)
    session = FusionSession(Params(), list(roles))
    for arrival in flight.arrivals():
        lost = {'quaternion': NAN4, 'velocity': NAN3} if arrival.role == 'odometry' else {}
        session.push(arrival.sample._replace(**lost))
    assert ('the odometry has no orientation; add a topic of fix_velocity'
            in session.health().text) == told
    assert session.estimator.nav_state().yaw_aligned != told


@pytest.mark.parametrize(('velocity', 'told'), [(False, True), (True, False)])
def test_a_yaw_that_fixes_without_velocity_cannot_tell_is_named(velocity, told):
    sensors = default_sensors(('imu', 'fix'))
    sensors['fix'] = replace(sensors['fix'], has_velocity=velocity)
    flight = Scenario(trajectory=Flight(duration=20.0, height=15.0), sensors=sensors, seed=1)
    session = FusionSession(Params(), ['imu', 'fix'])
    for arrival in flight.arrivals():
        session.push(arrival.sample)
    assert ('the fixes have no velocity; add a topic of fix_velocity'
            in session.health().text) == told


@pytest.mark.parametrize('roles', [ROLES, ('odometry', 'fix')])
def test_the_first_fix_after_a_gap_does_not_spoil_the_velocity(roles):
    """Odometry knows the velocity ten times better than a receiver with 0.3 m/s of noise."""
    gap = (60.0, 80.0)
    for seed in (2, 4):
        sensors = default_sensors(roles)
        sensors['fix'] = replace(
            sensors['fix'], outages=(gap,), stamp_delay=0.11, vel_noise=0.3)
        flight = Scenario(
            trajectory=Flight(duration=85.0, height=15.0), sensors=sensors, seed=seed)
        session = FusionSession(Params(), [*roles, 'fix_velocity'])
        rows = [(output.time_us, *output.nav.velocity[0:2]) for arrival in flight.arrivals()
                for output in session.push(arrival.sample)]
        table = np.array(rows)
        time = 1e-6 * (table[:, 0] - flight.start_us)
        error = np.linalg.norm(
            table[:, 1:] - flight.trajectory.motion(time).velocity[:, 0:2], axis=1)
        before, after = time > gap[0] + 10.0, time > gap[1]
        assert error[after].max() < 1.2 * error[before & ~after].max()
        aids = {aid.name: aid for aid in session.estimator.aid_statuses()}
        assert aids['gnss_position'].last_fused_us > flight.start_us + 84_000_000
