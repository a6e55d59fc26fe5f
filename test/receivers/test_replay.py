"""A recording of two receivers, replayed with one of them withheld for a while."""

from __future__ import annotations

import json

import numpy as np
import pytest
from receivers.flight import ORIGIN

from ekf_fusion_ros.simulation.gnss import Gnss
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import Flight

FLIGHT = Flight(duration=60.0, size=30.0, period=30.0, height=10.0)


@pytest.fixture(scope='module')
def recording(tmp_path_factory):
    pytest.importorskip('rosbags')
    from ekf_fusion_ros.replay.recording import write_recording

    sensors = default_sensors(('odometry', 'fix')) | {
        'fix_2': Gnss(origin=ORIGIN, phase=0.05, pos_noise=0.8),
        'fix_3': Gnss(origin=ORIGIN, phase=0.02, pos_noise=0.6)}
    path = tmp_path_factory.mktemp('receivers') / 'flight'
    write_recording(path, Scenario(trajectory=FLIGHT, sensors=sensors, seed=3).arrivals())
    return path


def replayed(recording, folder, *arguments):
    from ekf_fusion_ros.replay.cli import main

    switches = ['--topic', 'fix_velocity=/fix_velocity', '--no-bag']
    assert main([str(recording), '--output', str(folder), *switches, *arguments]) == 0
    rows = np.loadtxt(folder / 'trajectory.csv', delimiter=',', skiprows=1)
    return rows, json.loads((folder / 'summary.json').read_text())


BOTH = ('--topic', 'fix_2=/fix_2', '--topic', 'fix_velocity_2=/fix_velocity_2')


def test_a_second_receiver_is_fused_and_can_be_withheld(recording, tmp_path):
    rows, summary = replayed(recording, tmp_path / 'both', *BOTH)
    short, cut = replayed(recording, tmp_path / 'cut', *BOTH, '--withhold', 'fix_2=30:40')
    for topic in ('/fix_2', '/fix_velocity_2'):
        assert summary['topics'][topic]['accepted'] == 300
        assert cut['topics'][topic]['refused'] == {'withheld': 50}
    assert summary['topics']['/fix_2']['role'] == 'fix_2'
    assert set(summary['receivers']) == {'fix', 'fix_2'}
    assert sum(one['weights']['position'] for one in summary['receivers'].values()) == 1.0
    assert any('fix_2: the receiver is silent' in event['text'] for event in cut['events'])
    np.testing.assert_array_equal(rows[:, 0], short[:, 0])


def test_a_third_receiver_is_reached_by_its_roles(recording, tmp_path):
    third = ('--topic', 'fix_3=/fix_3', '--topic', 'fix_velocity_3=/fix_velocity_3',
             '--set', 'messages.fix_3.min_eph=40.0')
    _, summary = replayed(recording, tmp_path / 'three', *BOTH, *third)
    assert set(summary['receivers']) == {'fix', 'fix_2', 'fix_3'}
    for topic in ('/fix_3', '/fix_velocity_3'):
        assert summary['topics'][topic]['accepted'] == 300
    weights = {role: one['weights'] for role, one in summary['receivers'].items()}
    # Its position is declared too poor to count, its velocity is as good as any.
    assert weights['fix_3']['position'] == 0.0
    assert weights['fix_3']['velocity'] == pytest.approx(1 / 3, abs=0.01)


def test_without_it_the_recording_is_fused_as_if_it_had_one(recording, tmp_path):
    _, summary = replayed(recording, tmp_path / 'one')
    assert '/fix_2' not in summary['topics']
    assert summary['receivers'] == {}
