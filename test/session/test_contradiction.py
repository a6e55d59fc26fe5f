"""An odometry that stands still while the fixes go on: the health says that they contradict."""

from __future__ import annotations

import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import FigureOfEight

FROZEN_FROM = 40.0
ROLES = ('odometry', 'fix')


def arrivals(frozen):
    """Yield arrivals of a flight, of whose odometry the last message repeats from a time on."""
    scenario = Scenario(
        trajectory=FigureOfEight(duration=65.0, size=60.0, period=60.0),
        sensors=default_sensors(ROLES), seed=1)
    last = None
    for arrival in scenario.arrivals():
        seconds = 1e-6 * (arrival.time_us - scenario.start_us)
        if arrival.role == 'odometry' and frozen and seconds > FROZEN_FROM:
            still = last._replace(time_us=arrival.sample.time_us, velocity=0.0 * last.velocity)
            yield seconds, arrival._replace(sample=still)
            continue
        if arrival.role == 'odometry':
            last = arrival.sample
        yield seconds, arrival


def worst_health(frozen):
    session, told = FusionSession(Params(), ROLES), set()
    for seconds, arrival in arrivals(frozen):
        session.push(arrival.sample)
        if seconds > 20.0 and arrival.role == 'fix':
            told.add(session.health().text.split(' for ')[0])
    return told


def test_fixes_that_are_rejected_for_seconds_show_in_the_health():
    assert 'GNSS rejected' in worst_health(frozen=True)
    assert 'GNSS rejected' not in worst_health(frozen=False)


def test_a_replay_warns_of_fixes_that_were_lost(tmp_path, capsys):
    pytest.importorskip('rosbags')
    pytest.importorskip('tqdm')
    from ekf_fusion_ros.replay.cli import main
    from ekf_fusion_ros.replay.recording import write_recording
    write_recording(tmp_path / 'frozen', (arrival for _, arrival in arrivals(frozen=True)))
    assert main([str(tmp_path / 'frozen'), '--output', str(tmp_path), '--no-bag']) == 0
    assert 'warning: GNSS rejected for too long, reset to it, ' in capsys.readouterr().out


def test_an_imu_alone_is_told_to_know_no_motion():
    assert 'no topic in use tells horizontal motion' in FusionSession(
        Params(), ['imu', 'pressure']).health().text
    assert not FusionSession(Params(), ['imu', 'flow']).warnings()
    assert not FusionSession(Params(), ['imu', 'fix']).warnings()
