"""Slow sensors are told once, with role and rate, and refuse nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.sensor_rates import SensorRates
from ekf_fusion_ros.session import FusionSession

START = 1000.0
START_US = 1_000_000_000


class Drive:
    """Feeds a session at rates in Hz, integer fractions of 200; 0 = silent."""

    def __init__(self, build, estimator, *roles):
        self.session = FusionSession(Params(), roles, estimator=estimator)
        self._build = build
        self._step = 0

    def run(self, seconds, **rates):
        """Return the events about rates."""
        for _ in range(round(200 * seconds)):
            self._step += 1
            for role, rate in rates.items():
                if rate and self._step % (200 // rate) == 0:
                    message = getattr(self._build, role)(START + self._step / 200)
                    self.session.handle(role, message)
        return [event.text for event in self.session.drain_events() if ' Hz' in event.text]


@pytest.fixture
def drive(build, estimator):
    """Return a function that makes a drive with these roles."""
    return lambda *roles: Drive(build, estimator, *roles)


def test_sensors_of_the_least_rates_are_fine(drive):
    flight = drive('imu', 'fix', 'magnetic_field', 'pressure')
    assert flight.run(30.0, imu=100, fix=1, magnetic_field=5, pressure=5) == []
    health = flight.session.health()
    assert health.level == HealthLevel.OK
    assert {name: float(rate) for name, rate in health.values.items()} == {
        'rate.imu': 100.0, 'rate.magnetic_field': 5.0, 'rate.pressure': 5.0}


@pytest.mark.parametrize(('role', 'rate', 'least'), [
    ('imu', 50, 100), ('magnetic_field', 4, 5), ('pressure', 2, 5)])
def test_a_slow_sensor_is_told_once_and_anew_after_it_has_recovered(drive, role, rate, least):
    flight = drive('imu', 'fix', 'magnetic_field', 'pressure')
    fine = {'imu': 200, 'fix': 5, 'magnetic_field': 20, 'pressure': 20}
    assert flight.run(10.0, **fine) == []
    told = flight.run(20.0, **(fine | {role: rate}))
    assert len(told) == 1
    assert told[0].startswith(f'{role} comes at ') and f'less than the {least} Hz' in told[0]
    health = flight.session.health()
    assert health.level == HealthLevel.WARN and f'{role} comes at {rate}.0 Hz' in health.text
    assert flight.run(15.0, **fine) == []
    assert flight.session.health().level == HealthLevel.OK
    assert len(flight.run(20.0, **(fine | {role: rate}))) == 1
    assert not flight.session.statistics()[role].refused


def test_a_sensor_that_falls_silent_is_slow(drive):
    flight = drive('imu', 'fix', 'pressure')
    assert flight.run(10.0, imu=100, fix=5, pressure=20) == []
    assert flight.run(20.0, imu=100, fix=5, pressure=0) == [
        'pressure comes at 0.0 Hz, less than the 5 Hz that the filter needs']


def test_odometry_as_inertial_input_may_be_slower_than_an_imu(drive):
    flight = drive('odometry', 'fix')
    assert flight.run(20.0, odometry=20, fix=5) == []


def test_odometry_carries_the_height_between_rare_fixes(drive):
    flight = drive('odometry', 'fix')
    assert flight.run(60.0, odometry=10, fix=1) == []
    assert flight.session.health().level == HealthLevel.OK
    assert not any(name.startswith('rate.fix') for name in flight.session.health().values)


def test_without_pressure_the_fixes_are_the_height(drive):
    flight = drive('imu', 'fix')
    assert flight.run(20.0, imu=100, fix=2) == [
        'fix comes at 2.0 Hz, less than the 5 Hz that the filter needs']


def test_one_lost_message_is_not_slow():
    rates = SensorRates({'imu': 100, 'pressure': 5})
    heard, told = {'imu': (0, 0), 'pressure': (0, 0)}, []
    for step in range(3000):
        now_us = START_US + 10_000 * step
        for role, due in (('imu', True), ('pressure', step % 20 == 0 and step != 1000)):
            heard[role] = (heard[role][0] + 1, now_us) if due else heard[role]
        told += rates.step(now_us, heard)
    assert told == []


def test_the_rate_is_that_of_the_stamps_whatever_their_jitter():
    rates = SensorRates({'imu': 100})
    for step in range(700):
        now_us = START_US + 12_500 * step + (step * 7919) % 3000
        rates.step(now_us, {'imu': (step + 1, now_us)})
    assert float(rates.values()['rate.imu']) == pytest.approx(80.0, abs=0.1)
    assert len(rates.slow()) == 1


def test_the_recorded_imu_of_48_hz_is_told(shared: Path, tmp_path: Path):
    from ekf_fusion_ros.replay.cli import main
    recording = shared / 'data' / 'inav_quad_optflow' / 'inav_quad_optflow_mcap'
    assert main([str(recording), '--output', str(tmp_path), '--end', '20', '--no-bag']) == 0
    summary = (tmp_path / 'summary.json').read_text(encoding='utf-8')
    assert 'imu comes at 4' in summary and 'less than the 100 Hz' in summary
