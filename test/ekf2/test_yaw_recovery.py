"""When the EKF-GSF bank contradicts the yaw of the filter, and when it replaces it."""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
import pytest

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.yaw_estimator import YawEstimator
from ekf_fusion_ros.ekf2.yaw_recovery import YawRecovery
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import Flight


class Bank(YawEstimator):
    """A bank that is sure of what it is told."""

    def __init__(self, yaw_deg, sigma_deg, running=True):
        super().__init__()
        self.models['running'] = self._running = running
        self._told = math.radians(yaw_deg), math.radians(sigma_deg) ** 2

    def _combined(self):
        return self._told


def recovery(bank, *, own_sigma_deg=1.0, thorough=True):
    f = Filter(Ekf2Params(gnss=GnssParams(thorough_yaw_recovery=thorough)), 12)
    f.cov.add_yaw_variance(f.x[0:4], math.radians(own_sigma_deg) ** 2)
    return YawRecovery(f, Resets(f), bank)


@pytest.mark.parametrize(('yaw', 'sigma', 'contradicted'), [
    (24.0, 1.0, False), (26.0, 1.0, True), (-26.0, 1.0, True), (179.0, 5.0, True),
    (44.0, 14.9, False), (46.0, 14.9, True), (90.0, 15.1, False)])
def test_a_certain_bank_with_another_yaw_contradicts(yaw, sigma, contradicted):
    """Beyond 25 deg and three sigmas, where the bank is known to 15 deg."""
    assert recovery(Bank(yaw, sigma)).contradicted() is contradicted


def test_an_uncertain_yaw_is_not_contradicted():
    assert not recovery(Bank(50.0, 1.0), own_sigma_deg=20.0).contradicted()
    assert recovery(Bank(70.0, 1.0), own_sigma_deg=20.0).contradicted()


@pytest.mark.parametrize(('running', 'thorough'), [(False, True), (True, False)])
def test_a_bank_that_rests_or_is_not_asked_contradicts_nothing(running, thorough):
    asked = recovery(Bank(90.0, 1.0, running), thorough=thorough)
    assert not asked.contradicted()


def yaw_errors(motor_field, seed):
    """Fly with motors that disturb the compass; return time s, yaw error deg, and the filter."""
    flight = Flight(duration=90.0, size=40.0, period=20.0, height=15.0)
    sensors = default_sensors(('imu', 'fix', 'magnetic_field', 'pressure', 'landed'))
    sensors['magnetic_field'] = replace(sensors['magnetic_field'], motor_field=motor_field)
    sensors['fix'] = replace(sensors['fix'], stamp_delay=0.11)
    scenario = Scenario(trajectory=flight, sensors=sensors, seed=seed)
    # the gates of the reference's own run
    ekf = Ekf2(Ekf2Params(gnss=GnssParams(vel_gate=1.0, pos_gate=1.0)))
    rows = []
    for arrival in scenario.arrivals():
        ekf.push(arrival.sample)
        if isinstance(arrival.sample, ImuSample) and ekf.update():
            w, x, y, z = ekf.filter.x[0:4]
            rows.append(((ekf.filter.imu.time_us - scenario.start_us) * 1e-6,
                         math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))))
    time, yaw = np.array(rows).T
    error = yaw - np.asarray(flight.motion(time).yaw)
    return time, np.degrees((error + math.pi) % (2.0 * math.pi) - math.pi), ekf


@pytest.mark.slow
@pytest.mark.parametrize('seed', [1, 2, 3])
def test_a_compass_that_motors_turn_at_take_off_is_found_out(seed):
    time, error, ekf = yaw_errors((-0.35, 0.3, 0.0), seed)
    seen = ekf.filter.events.seen
    assert EventKind.EMERGENCY_YAW_RESET in seen
    assert ekf.filter.flags.mag_fault
    assert not {'mag_hdg', 'mag_3d'} & {
        name for name in ekf.filter.flags.__slots__ if getattr(ekf.filter.flags, name)}
    assert np.abs(error).max() > 60.0
    assert np.abs(error[time > 60.0]).max() < 10.0


@pytest.mark.slow
def test_a_compass_that_motors_hardly_turn_is_kept():
    _, error, ekf = yaw_errors((0.02, 0.0, 0.0), 1)
    assert EventKind.EMERGENCY_YAW_RESET not in ekf.filter.events.seen
    assert not ekf.filter.flags.mag_fault
    assert np.abs(error[-1000:]).max() < 10.0
