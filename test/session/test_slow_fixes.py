"""Fixes at 1 Hz, as many receivers send them, beside odometry."""

from __future__ import annotations

from dataclasses import replace

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import FigureOfEight

ROLES = ('odometry', 'fix')
JITTER_US = 30_000


def stops(outage):
    """Return how often GNSS is told to have stopped, of fixes whose stamps jitter."""
    sensors = default_sensors(ROLES)
    sensors['fix'] = replace(sensors['fix'], rate=1.0, outages=outage)
    scenario = Scenario(
        trajectory=FigureOfEight(duration=60.0, size=60.0, period=60.0), sensors=sensors, seed=1)
    session, fixes = FusionSession(Params(), ROLES), 0
    for arrival in scenario.arrivals():
        sample = arrival.sample
        if arrival.role == 'fix':
            fixes += 1
            late = JITTER_US if fixes % 2 else -JITTER_US
            sample = sample._replace(time_us=sample.time_us + late)
        session.push(sample)
    assert any(status.name == 'gnss_position' and status.fused > 30
               for status in session.estimator.aid_statuses())
    return sum('GNSS data stopped' in event.text for event in session.drain_events())


def test_a_receiver_of_one_hertz_does_not_stop_with_every_fix():
    assert stops(()) == 0


def test_an_outage_of_some_seconds_is_told():
    assert stops(((40.0, 46.0),)) == 1
