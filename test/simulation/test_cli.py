"""The simulate command."""

import csv

import pytest

from ekf_fusion_ros.simulation import demo
from ekf_fusion_ros.simulation.cli import main


def test_recording_and_truth_are_written(tmp_path, capsys):
    pytest.importorskip('rosbags')
    status = main([str(tmp_path / 'out'), '--trajectory', 'circle', '--duration', '10',
                   '--roles', 'odometry,fix', '--outage', 'fix=2:4'])
    assert status == 0
    assert (tmp_path / 'out' / 'recording' / 'metadata.yaml').exists()
    with (tmp_path / 'out' / 'truth.csv').open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 501
    assert float(rows[0]['lat']) == pytest.approx(47.397742)
    assert float(rows[-1]['z']) == pytest.approx(10.0)
    said = capsys.readouterr().out
    assert '/fix' in said
    assert '41 messages' in said


def test_further_sensors_and_wind(tmp_path, capsys):
    pytest.importorskip('rosbags')
    status = main([str(tmp_path / 'out'), '--trajectory', 'loiter', '--duration', '10', '--roles',
                   'imu,fix,range,flow,airspeed,landed,gps_heading,aux_velocity',
                   '--wind', '3,-2'])
    assert status == 0
    said = capsys.readouterr().out
    for topic in ('/range', '/flow', '/airspeed', '/landed', '/gps_heading', '/aux_velocity'):
        assert topic in said
    with (tmp_path / 'out' / 'truth.csv').open() as stream:
        row = list(csv.DictReader(stream))[-1]
    assert (float(row['wind_x']), float(row['wind_y']), float(row['ground'])) == (-2.0, 3.0, 0.0)


def test_existing_recording_is_not_touched(tmp_path, capsys):
    (tmp_path / 'recording').mkdir()
    assert main([str(tmp_path), '--duration', '1']) == 1
    assert 'exists' in capsys.readouterr().err


@pytest.mark.parametrize(('arguments', 'named'), [
    (['--duration', '-3'], '--duration'),
    (['--seed', '-3'], '--seed'),
    (['--roles', 'odometry,sonar'], 'sonar'),
    (['--wind', '3'], '--wind'),
    (['--outage', 'fix=10'], '--outage'),
    (['--roles', 'imu', '--outage', 'fix=10:20'], 'fix'),
    (['--trajectory', 'loop'], 'loop'),
])
def test_wrong_arguments_are_named(tmp_path, capsys, arguments, named):
    assert main([str(tmp_path / 'out'), *arguments]) == 2
    assert named in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()


@pytest.mark.parametrize('arguments', [['--seeds', '0'], ['--seed', '-1'], ['--what']])
def test_demo_refuses_wrong_arguments(capsys, arguments):
    assert demo.main(arguments) == 2
    assert 'error' in capsys.readouterr().err
