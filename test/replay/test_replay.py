"""The command line end to end: files, windows, exit statuses, damaged input."""

from __future__ import annotations

import csv
from dataclasses import replace
import gzip
import json
import math
import os
import shutil
import subprocess
import sys
from unittest.mock import Mock

import numpy as np
import pytest

pytest.importorskip('rosbags')
pytest.importorskip('tqdm')

from rosbags.rosbag2 import Reader
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores
from rosbags.typesys import get_typestore

from ekf_fusion_ros.replay import cli
from ekf_fusion_ros.replay.cli import main
from ekf_fusion_ros.replay.recording import write_recording
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import FigureOfEight

STORE = get_typestore(Stores.ROS2_JAZZY)
HEADER = 't,x,y,z,qx,qy,qz,qw,vx,vy,vz,yaw,var_x,var_y,var_z,var_yaw'.split(',')
AUTOPILOT = ('imu', 'fix', 'magnetic_field', 'pressure')
DURATION = 30.0


@pytest.fixture(scope='module')
def flight(tmp_path_factory):
    """A simulated recording with the sensors of an autopilot and its truth."""
    folder = tmp_path_factory.mktemp('flight')
    scenario = Scenario(
        trajectory=FigureOfEight(duration=DURATION), sensors=default_sensors(AUTOPILOT), seed=3)
    write_recording(folder / 'flight', scenario.arrivals())
    return folder / 'flight', scenario


@pytest.fixture(scope='module')
def replayed(flight, tmp_path_factory):
    output = tmp_path_factory.mktemp('replayed')
    assert main([str(flight[0]), '--output', str(output)]) == 0
    return output


def rows(output):
    with (output / 'trajectory.csv').open() as file:
        table = list(csv.reader(file))
    assert table[0] == HEADER
    return np.array(table[1:], dtype=float)


def summary(output):
    return json.loads((output / 'summary.json').read_text())


def test_summary_has_home_and_how_it_came_to_be(replayed, flight):
    told = summary(replayed)
    home, origin = told['home'], flight[1].origin
    # One fix of 1.3 m, seen after the ten seconds of the checks.
    assert home['lat'] == pytest.approx(origin.lat, abs=3e-4)
    assert home['time'] > told['start'] + 10.0
    assert not home['manual']
    texts = [event['text'] for event in told['events']]
    assert 'global position valid' in texts
    assert any(text.startswith('home set: ') for text in texts)
    assert told['navigation']['global_position_valid'] is True


def run(recording, output, *arguments):
    return main([str(recording), '--output', str(output), '--no-bag', *arguments])


def test_files_and_their_agreement(flight, replayed):
    table = rows(replayed)
    tum = np.loadtxt(replayed / 'trajectory.tum')
    assert len(table) > 500
    assert np.array_equal(tum, table[:, :8])
    assert np.allclose(np.linalg.norm(table[:, 4:8], axis=1), 1.0, atol=1e-9)
    x, y, z, w = table[:, 4:8].T
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    assert np.allclose(np.angle(np.exp(1j * (yaw - table[:, 11]))), 0.0, atol=1e-9)
    assert (table[:, 12:] > 0).all()
    assert np.allclose(np.diff(table[:, 0]), 0.02, atol=0.013)


def horizontal_rms(scenario, output):
    """Return the error against truth in m after the alignment."""
    table = rows(output)
    table = table[table[:, 0] > scenario.start_us * 1e-6 + 15.0]
    origin = summary(output)['origin']
    # Small angles: metres per degree on the WGS84 ellipsoid at this latitude.
    lat = math.radians(scenario.origin.lat)
    north = (origin['lat'] - scenario.origin.lat) * (111132.95 - 559.85 * math.cos(2 * lat))
    east = (origin['lon'] - scenario.origin.lon) * (
        111412.88 * math.cos(lat) - 93.5 * math.cos(3 * lat))
    truth = scenario.trajectory.motion(table[:, 0] - scenario.start_us * 1e-6).position
    errors = np.hypot(table[:, 1] + east - truth[:, 1], table[:, 2] + north - truth[:, 0])
    return np.sqrt(np.mean(np.square(errors)))


def test_the_track_follows_the_truth(flight, replayed):
    assert horizontal_rms(flight[1], replayed) < 1.5


def test_summary_is_complete_and_exact(flight, replayed):
    about = summary(replayed)
    assert about['frame'] == 'map'
    assert set(about['origin']) == {'lat', 'lon', 'alt'}
    assert about['duration'] == pytest.approx(DURATION, abs=0.5)
    for topic in about['topics'].values():
        assert topic['received'] == topic['accepted'] + sum(topic['refused'].values())
    counts = {topic['role']: topic['received'] for topic in about['topics'].values()}
    with Reader(flight[0]) as reader:
        recorded = {one.topic: one.msgcount for one in reader.connections}
    assert counts['imu'] == recorded['/imu/data_raw']
    assert counts['fix'] == recorded['/fix']
    position = about['aid_sources']['gnss_position']
    assert position['fused'] > 50 and position['starts'] >= 1
    assert position['first'] < position['last']
    assert {'events', 'resets', 'alignment', 'cpu_seconds', 'real_time_factor', 'versions',
            'recording'} <= set(about)
    assert about['events']


def test_fused_bag_holds_the_rows(replayed):
    table = rows(replayed)
    with Reader(replayed / 'fused') as reader:
        odometry = [STORE.deserialize_cdr(data, one.msgtype)
                    for one, _, data in reader.messages() if one.topic == '/odometry/filtered']
        topics = {one.topic for one in reader.connections}
    assert topics == {'/odometry/filtered', '/odometry/gps', '/gps/filtered'}
    assert len(odometry) == len(table)
    for message, row in zip(odometry[::50], table[::50], strict=True):
        position = message.pose.pose.position
        fourteen_digits = pytest.approx([*row[1:4], row[12]], rel=1e-13)
        assert [position.x, position.y, position.z,
                message.pose.covariance[0]] == fourteen_digits
        stamp = message.header.stamp
        assert stamp.sec + stamp.nanosec * 1e-9 == pytest.approx(row[0], abs=1e-6)


def test_same_input_same_bytes(flight, replayed, tmp_path):
    assert main([str(flight[0]), '--output', str(tmp_path)]) == 0
    for name in ('trajectory.csv', 'trajectory.tum', 'alignment.csv'):
        assert (tmp_path / name).read_bytes() == (replayed / name).read_bytes()
    bags = [next((folder / 'fused').glob('*.mcap')) for folder in (tmp_path, replayed)]
    assert bags[0].read_bytes() == bags[1].read_bytes()


def test_rate_zero_holds_the_slower_rows(flight, replayed, tmp_path):
    assert run(flight[0], tmp_path, '--rate', '0') == 0
    every, slow = rows(tmp_path), rows(replayed)
    assert len(every) > 1.8 * len(slow)
    found = np.isin(slow[:, 0], every[:, 0])
    assert found.all()
    same = every[np.isin(every[:, 0], slow[:, 0])]
    assert np.array_equal(same, slow)


def test_start_and_end(flight, tmp_path):
    assert run(flight[0], tmp_path, '--start', '2', '--end', '20') == 0
    about = summary(tmp_path)
    table = rows(tmp_path)
    start = flight[1].start_us * 1e-6
    assert table[-1, 0] == pytest.approx(start + 20, abs=0.1)
    imu = next(topic for topic in about['topics'].values() if topic['role'] == 'imu')
    assert imu['received'] == pytest.approx(18 * 250, abs=3)
    assert about['replayed'] == pytest.approx(18)


def test_withheld_fixes_are_counted_and_not_fused(flight, replayed, tmp_path):
    assert run(flight[0], tmp_path, '--withhold', 'fix=15:20,22:23') == 0
    fix = next(t for t in summary(tmp_path)['topics'].values() if t['role'] == 'fix')
    assert fix['refused'] == {'withheld': 30}
    whole, gap = rows(replayed), rows(tmp_path)
    assert len(whole) == len(gap)
    start = flight[1].start_us * 1e-6
    before = whole[:, 0] < start + 15.0
    assert np.array_equal(whole[before], gap[before])
    inside = (whole[:, 0] > start + 17.0) & (whole[:, 0] < start + 20.0)
    assert (gap[inside, 12] > whole[inside, 12]).all()


def test_withheld_fixes_score_the_prediction(flight, replayed, tmp_path, capsys):
    pymap3d = pytest.importorskip('pymap3d')
    assert run(flight[0], tmp_path, '--withhold', 'fix=15:20,22:23') == 0
    about, track = summary(tmp_path), rows(tmp_path)
    origin, start_us = about['origin'], flight[1].start_us
    distances = []
    for arrival in flight[1].arrivals():
        seconds = (arrival.time_us - start_us) * 1e-6
        if arrival.role == 'fix' and (15.0 <= seconds < 20.0 or 22.0 <= seconds < 23.0):
            fix = arrival.sample
            east, north, _ = pymap3d.geodetic2enu(
                fix.lat, fix.lon, origin['alt'], origin['lat'], origin['lon'], origin['alt'])
            # ekf2.gnss.delay_ms is 110 unless told otherwise
            at = fix.time_us * 1e-6 - 0.11
            distances.append(math.hypot(*(
                np.interp(at, track[:, 0], track[:, axis]) - place
                for axis, place in ((1, east), (2, north)))))
    told = about['withheld_distance']
    assert told['count'] == len(distances) == 30
    assert told['rms'] == pytest.approx(np.sqrt(np.mean(np.square(distances))), abs=0.01)
    assert told['largest'] == pytest.approx(max(distances), abs=0.01)
    assert f'withheld fixes: track passes by {told["rms"]:.2f} m RMS' in capsys.readouterr().out
    assert summary(replayed)['withheld_distance'] is None


def test_states_of_every_update(flight, tmp_path):
    assert run(flight[0], tmp_path, '--log-states', '--end', '5') == 0
    with (tmp_path / 'estimator.csv').open() as file:
        table = list(csv.DictReader(file))
    assert len(table) > 300
    norm = sum(float(table[-1][name]) ** 2 for name in ('q0', 'q1', 'q2', 'q3'))
    assert norm == pytest.approx(1.0, abs=1e-6)


def test_role_kept_out_and_role_added(flight, tmp_path, capsys):
    assert run(flight[0], tmp_path, '--topic', 'magnetic_field=', '--end', '3') == 0
    assert 'magnetic_field' not in [t['role'] for t in summary(tmp_path)['topics'].values()]
    assert 'left out as asked: /mag' in capsys.readouterr().out


def test_a_switch_of_the_node_holds_here_too(flight, tmp_path, capsys):
    assert run(flight[0], tmp_path, '--end', '5', '--set', 'node.use_fix=false') == 0
    assert 'switched off by node.use_fix' in capsys.readouterr().out
    assert summary(tmp_path)['frame'] == 'local'
    assert '/fix' not in summary(tmp_path)['topics']


def test_what_was_refused_is_said_in_a_sentence(tmp_path, capsys):
    """Fixes that are recorded 0.6 s after their stamp come too late for the filter."""
    sensors = default_sensors(AUTOPILOT)
    sensors['fix'] = replace(sensors['fix'], latency=0.6, has_velocity=False)
    scenario = Scenario(trajectory=FigureOfEight(duration=8.0), sensors=sensors, seed=3)
    write_recording(tmp_path / 'late', scenario.arrivals())
    assert run(tmp_path / 'late', tmp_path / 'out') == 0
    said = capsys.readouterr().out
    assert '/fix: too_old, the first: stamp 0.59' in said
    assert 'no output: the origin was never set (waiting for' in said
    assert 'session.horizon_ms' in summary(tmp_path / 'out')[
        'topics']['/fix']['first_refusals']['too_old']


def test_parameters_in_order_of_files_then_set(flight, tmp_path):
    first, second = tmp_path / 'first.yaml', tmp_path / 'second.yaml'
    for path, rate in ((first, 5), (second, 10)):
        path.write_text(f'/**:\n  ros__parameters:\n    session:\n      output_rate: {rate}.0\n')
    arguments = ['--params', str(first), '--params', str(second), '--end', '20']
    assert run(flight[0], tmp_path / 'a', *arguments) == 0
    assert np.median(np.diff(rows(tmp_path / 'a')[:, 0])) == pytest.approx(0.1, abs=0.01)
    assert run(flight[0], tmp_path / 'b', *arguments, '--set', 'session.output_rate=20') == 0
    assert np.median(np.diff(rows(tmp_path / 'b')[:, 0])) == pytest.approx(0.05, abs=0.01)


@pytest.mark.parametrize(('arguments', 'words'), [
    (['--set', 'ekf2.gnss.dely_ms=3'], 'ekf2.gnss.delay_ms'),
    (['--set', 'ekf2.gnss.delay_ms=-3'], 'at least 0'),
    (['--set', 'ekf2.gnss.delay_ms=soon'], 'a number'),
    (['--set', 'nonsense'], 'name=value'),
    (['--params', 'none.yaml'], 'none.yaml'),
    (['--topic', 'odometer=/odom'], 'unknown role'),
    (['--topic', 'fix'], 'role=/name'),
    (['--withhold', 'fix=20'], 'window'),
    (['--withhold', 'fix=20:10'], 'ends before'),
    (['--withhold', 'odometry=5:10'], 'no topic of'),
    (['--withhold', 'fix=10:20,1000:2000'], 'fix=1000:2000: the replay of'),
    (['--end', '20', '--withhold', 'fix=22:25'], 'ends 20.0 s after its start'),
    (['--start', '-1'], 'seconds from 0'),
    (['--start', '5', '--end', '4'], 'not after'),
    (['--start', '500'], 'ends 30'),
    (['--end', 'soon'], 'seconds from 0'),
    (['--rate', '-1'], 'at least 0'),
    (['--rate', 'fast'], 'invalid float'),
    (['--nonsense'], 'unrecognized'),
])
def test_wrong_arguments_end_with_2_and_a_sentence(flight, tmp_path, capsys, arguments, words):
    assert run(flight[0], tmp_path / 'out', *arguments) == 2
    said = capsys.readouterr().err
    assert words in said
    assert 'Traceback' not in said


def test_a_field_model_without_its_package(flight, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'pygeomag', None)
    assert run(flight[0], tmp_path / 'out', '--set', 'ekf2.mag.field_model=wmm') == 2
    said, = capsys.readouterr().err.splitlines()
    assert 'pygeomag' in said
    assert not (tmp_path / 'out' / 'trajectory.csv').exists()


def test_output_that_is_a_file(flight, tmp_path, capsys):
    (tmp_path / 'out').write_text('')
    assert run(flight[0], tmp_path / 'out') == 2
    assert 'out' in capsys.readouterr().err


FILES_OF_A_USER = ('notes.txt', 'fused_0.mcap', 'metadata.yaml/notes.txt')


@pytest.mark.parametrize('estimators', ['ekf2', 'lpe,ekf2'])
@pytest.mark.parametrize('name', FILES_OF_A_USER)
def test_a_fused_folder_of_someone_else_stays(flight, tmp_path, capsys, name, estimators):
    """It is refused before anything is written, also where it is that of the second run."""
    output = tmp_path / 'out'
    place = output / 'ekf2' if ',' in estimators else output
    (place / 'fused' / name).parent.mkdir(parents=True)
    (place / 'fused' / name).write_text('mine')
    before = sorted(output.rglob('*'))
    assert main([str(flight[0]), '--output', str(output), '--estimator', estimators]) == 2
    assert f'holds {name.split("/")[0]}' in capsys.readouterr().err
    assert sorted(output.rglob('*')) == before
    assert (place / 'fused' / name).read_text() == 'mine'


def test_the_recording_that_is_read_is_never_replaced(flight, tmp_path, capsys):
    place = tmp_path / 'fused'
    shutil.copytree(flight[0], place)
    (place / 'flight.mcap').rename(place / 'fused.mcap')
    (tmp_path / 'link').symlink_to(place)
    for recording in (place, place / 'fused.mcap', tmp_path / 'link'):
        assert main([str(recording), '--output', str(tmp_path)]) == 2
        assert 'holds the recording' in capsys.readouterr().err
    assert (place / 'fused.mcap').stat().st_size > 1000
    assert sorted(path.name for path in tmp_path.iterdir()) == ['fused', 'link']


@pytest.mark.parametrize('kind', ['file', 'link'])
def test_fused_that_is_no_folder_stays(flight, tmp_path, capsys, kind):
    output, elsewhere = tmp_path / 'out', tmp_path / 'elsewhere'
    output.mkdir()
    elsewhere.mkdir()
    if kind == 'file':
        (output / 'fused').write_text('mine')
    else:
        (output / 'fused').symlink_to(elsewhere)
    assert main([str(flight[0]), '--output', str(output)]) == 2
    assert 'not a folder of an earlier replay' in capsys.readouterr().err
    assert [path.name for path in output.iterdir()] == ['fused']
    assert elsewhere.is_dir()


def test_the_bag_of_an_earlier_replay_is_replaced(flight, replayed, tmp_path):
    (tmp_path / 'fused').mkdir()
    (tmp_path / 'fused' / 'fused.mcap').write_text('cut short, without its metadata')
    assert main([str(flight[0]), '--output', str(tmp_path)]) == 0
    assert main([str(flight[0]), '--output', str(tmp_path)]) == 0
    bag = tmp_path / 'fused' / 'fused.mcap'
    assert bag.read_bytes() == (replayed / 'fused' / 'fused.mcap').read_bytes()


@pytest.mark.parametrize('name', ['none', 'none.mcap', 'none.csv'])
def test_missing_recording_ends_with_1(tmp_path, capsys, name):
    assert run(tmp_path / name, tmp_path / 'out') == 1
    assert name in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()


@pytest.mark.parametrize(('name', 'content'), [
    ('a.mcap', b''), ('a.db3', b'junk' * 500), ('a.txt', b'text'), ('a.csv', b''),
    ('a.csv', b'time_us,sensor\n'), ('a.csv.gz', b'no gzip'), ('a.csv', b'\xff\xfe\x00junk\n'),
])
def test_foreign_recording_ends_with_1_and_one_sentence(tmp_path, capsys, name, content):
    path = tmp_path / name
    path.write_bytes(content)
    assert run(path, tmp_path / 'out') == 1
    said = capsys.readouterr().err.strip()
    assert name in said
    assert '\n' not in said


@pytest.mark.parametrize(('arguments', 'buffering'), [
    (['--help'], ''), (['--no-bag'], ''), (['--no-bag'], '1')])
def test_a_reader_that_has_enough_is_no_error(flight, tmp_path, arguments, buffering):
    reading, writing = os.pipe()
    os.close(reading)
    with open(writing, 'w') as pipe:
        ended = subprocess.run(
            [sys.executable, '-m', 'ekf_fusion_ros.replay.cli', str(flight[0]), '--output',
             str(tmp_path / 'out'), '--end', '3', *arguments], stdout=pipe,
            stderr=subprocess.PIPE, text=True, env=os.environ | {'PYTHONUNBUFFERED': buffering})
    assert (ended.returncode, ended.stderr) == (1, '')


@pytest.mark.parametrize(('error', 'words'), [
    (OSError('disk on fire'), 'out: disk on fire'), (TimeoutError(), 'out: TimeoutError'),
    (OSError(28, 'No space left on device', 'a.csv'), 'a.csv: No space left on device')])
def test_an_error_of_the_system_is_told(flight, tmp_path, monkeypatch, capsys, error, words):
    monkeypatch.setattr(cli, 'replay', Mock(side_effect=error))
    assert run(flight[0], tmp_path / 'out') == 1
    assert capsys.readouterr().err.rstrip().endswith(words)


def test_a_folder_without_a_recording_ends_with_1(tmp_path, capsys):
    assert run(tmp_path, tmp_path / 'out') == 1
    said = capsys.readouterr().err
    assert 'holds no file ending in .mcap' in said
    assert 'metadata' not in said


def test_the_name_of_a_sensor_csv_is_said_once(tmp_path, capsys):
    path = tmp_path / 'rows.csv'
    path.write_text('1000,baro,100.0\n')
    assert run(path, tmp_path / 'out') == 1
    said = capsys.readouterr().err
    assert said.count('rows.csv') == 1
    assert 'no imu row' in said


def test_missing_topic_ends_with_1(flight, tmp_path, capsys):
    assert run(flight[0], tmp_path / 'out', '--topic', 'odometry=/odom') == 1
    assert '/odom' in capsys.readouterr().err


def test_truncated_recording_is_replayed_as_far_as_it_goes(flight, replayed, tmp_path, capsys):
    data = next(flight[0].glob('*.mcap')).read_bytes()
    cut = tmp_path / 'cut.mcap'
    cut.write_bytes(data[:int(0.8 * len(data))])
    assert run(cut, tmp_path / 'out') == 0
    assert 'damaged' in capsys.readouterr().out
    whole, part = rows(replayed), rows(tmp_path / 'out')
    assert 0.6 * len(whole) < len(part) < 0.95 * len(whole)
    assert np.array_equal(part[:-5], whole[:len(part) - 5])
    assert any('damaged' in note for note in summary(tmp_path / 'out')['notes'])


def rewritten(source, target, change):
    """Write a recording again; change(topic, seconds) gives a shift of stamps, None drops."""
    with Reader(source) as reader, \
            Writer(target, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {one.topic: writer.add_connection(one.topic, one.msgtype, typestore=STORE)
                       for one in reader.connections}
        for one, time_ns, data in reader.messages():
            shift = change(one.topic, (time_ns - reader.start_time) * 1e-9)
            if shift is not None:
                message = STORE.deserialize_cdr(data, one.msgtype)
                message.header.stamp.sec += shift
                writer.write(connections[one.topic], time_ns,
                             STORE.serialize_cdr(message, one.msgtype))


def test_a_whole_run_has_no_warning_of_a_break(replayed):
    assert not any('output' in told or 'again' in told for told in summary(replayed)['warnings'])


def test_restarts_and_gaps_are_told(flight, tmp_path, capsys):
    """The clock leaps by 20 s once, so that the estimator starts again and the rows pause."""
    rewritten(flight[0], tmp_path / 'leap', lambda _, t: 20 if t > 13.0 else 0)
    assert run(tmp_path / 'leap', tmp_path / 'out') == 0
    restart, = [told for told in summary(tmp_path / 'out')['warnings'] if 'again' in told]
    assert restart.startswith('the estimator started again once, 1')
    assert float(restart.split()[5]) == pytest.approx(13.0, abs=0.1)
    gap, = [told for told in summary(tmp_path / 'out')['warnings'] if 'no output' in told]
    times = rows(tmp_path / 'out')[:, 0]
    assert float(gap.split()[3]) == pytest.approx(np.diff(times).max(), abs=0.06)
    said = capsys.readouterr().out
    assert f'warning: {restart}' in said
    assert f'warning: {gap}' in said


def test_counts_of_the_aiding_go_on_over_a_restart(flight, tmp_path):
    leap = 12.0
    rewritten(flight[0], tmp_path / 'leap', lambda _, t: 20 if t > leap else 0)
    assert run(tmp_path / 'leap', tmp_path / 'out') == 0
    assert run(tmp_path / 'leap', tmp_path / 'before', '--end', str(leap)) == 0
    start = summary(tmp_path / 'out')['start']
    whole, before = (summary(tmp_path / name)['aid_sources']['gnss_position']
                     for name in ('out', 'before'))
    # Five fixes a second, in use from about 10 s after each start to the leap and to the end.
    assert before['fused'] > 5
    assert whole['fused'] > before['fused'] + 25
    assert whole['starts'] == 2
    assert whole['first'] == before['first'] < start + leap
    assert whole['last'] > start + 20.0 + leap + 10.0


def test_an_output_that_ends_early_is_told(flight, tmp_path):
    rewritten(flight[0], tmp_path / 'dead', lambda topic, t: None if topic == '/imu/data_raw'
              and t > 20.0 else 0)
    assert run(tmp_path / 'dead', tmp_path / 'out') == 0
    gap, = [told for told in summary(tmp_path / 'out')['warnings'] if 'no output' in told]
    assert float(gap.split()[3]) == pytest.approx(10.0, abs=0.3)
    assert float(gap.split()[6]) == pytest.approx(20.0, abs=0.3)
    # Nothing is missing of what was asked for.
    assert run(tmp_path / 'dead', tmp_path / 'part', '--end', '21') == 0
    assert not any('no output' in told for told in summary(tmp_path / 'part')['warnings'])


def spoil(message, rng):
    """Spoil a message in one of many ways."""
    ways = [
        lambda m: (setattr(m.header.stamp, 'sec', 0), setattr(m.header.stamp, 'nanosec', 0)),
        lambda m: setattr(m.header.stamp, 'sec', m.header.stamp.sec + 100_000),
        lambda m: setattr(m.header.stamp, 'sec', m.header.stamp.sec - 1),
    ]
    if hasattr(message, 'linear_acceleration'):
        ways += [
            lambda m: setattr(m.linear_acceleration, 'x', math.nan),
            lambda m: setattr(m.angular_velocity, 'z', math.inf),
            lambda m: setattr(m, 'angular_velocity_covariance', np.full(9, math.nan)),
        ]
    if hasattr(message, 'latitude'):
        ways += [
            lambda m: setattr(m, 'latitude', math.nan),
            lambda m: setattr(m.status, 'status', -1),
            lambda m: setattr(m, 'position_covariance', np.full(9, -4.0)),
        ]
    ways[rng.integers(len(ways))](message)


def test_bad_messages_between_good_ones(flight, tmp_path):
    """Each is counted by reason, the output stays finite and near the truth."""
    rng = np.random.default_rng(1)
    spoiled = tmp_path / 'spoiled'
    with Reader(flight[0]) as reader, \
            Writer(spoiled, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connections = {one.topic: writer.add_connection(one.topic, one.msgtype, typestore=STORE)
                       for one in reader.connections}
        for number, (one, time_ns, data) in enumerate(reader.messages()):
            if number % 10 == 9:
                message = STORE.deserialize_cdr(data, one.msgtype)
                spoil(message, rng)
                data = STORE.serialize_cdr(message, one.msgtype)
            if number % 97 == 5:
                writer.write(connections[one.topic], time_ns, bytes(data)[:18])
            writer.write(connections[one.topic], time_ns, data)
    assert run(spoiled, tmp_path / 'out') == 0
    about, table = summary(tmp_path / 'out'), rows(tmp_path / 'out')
    reasons = set()
    for topic in about['topics'].values():
        assert topic['received'] == topic['accepted'] + sum(topic['refused'].values())
        reasons |= set(topic['refused'])
    assert {'zero_stamp', 'stamp_jump', 'backward_stamp', 'not_finite', 'nan_covariance',
            'undecodable'} <= reasons
    assert len(table) > 300
    assert np.isfinite(table).all()
    assert horizontal_rms(flight[1], tmp_path / 'out') < 1.5
    assert about['resets']['restarts'] == 0


def test_sensor_csv(tmp_path):
    """At rest with barometer and magnetometer alone: level, and it stays where it is."""
    lines = []
    for step in range(1, 1251):
        time_us = 1_000_000 + 8000 * step
        if step % 5 == 0:
            lines += [f'{time_us},mag,0.21,0.0,0.42', f'{time_us},baro,100.0']
        lines.append(f'{time_us},imu,0.0,0.0,-9.80665,0.0,0.0,0.0')
    path = tmp_path / 'rest.csv.gz'
    path.write_bytes(gzip.compress('\n'.join(lines).encode()))
    assert run(path, tmp_path / 'out', '--set', 'ekf2.gnss.enabled=false', '--log-states') == 0
    about, table = summary(tmp_path / 'out'), rows(tmp_path / 'out')
    assert about['frame'] == 'local'
    assert about['topics']['imu']['received'] == 1250
    assert np.abs(table[:, 1:4]).max() < 0.1
    assert np.abs(table[:, 4:6]).max() < 0.01
    assert np.degrees(table[-1, 11]) == pytest.approx(90.0, abs=1.0)


@pytest.fixture(scope='module')
def husky(shared, tmp_path_factory):
    """A folder of a real recording in several storages, and the track of one of them."""
    folder = shared / 'data' / 'rl_husky'
    if not folder.is_dir():
        pytest.skip('recording rl_husky is not beside the repository')
    output = tmp_path_factory.mktemp('husky')
    assert run(folder / 'rl_husky_mcap', output, '--end', '40') == 0
    return folder, (output / 'trajectory.csv').read_bytes()


@pytest.mark.parametrize('storage', [
    'rl_husky_db3', 'rl_husky_db3_zstd_file', 'rl_husky_db3_zstd_message', 'rl_husky_mcap_zstd'])
def test_storages_of_a_real_recording_give_one_track(husky, tmp_path, storage):
    folder, track = husky
    assert run(folder / storage, tmp_path, '--end', '40') == 0
    assert (tmp_path / 'trajectory.csv').read_bytes() == track
    assert len(rows(tmp_path)) > 500


def test_odometry_alone_is_local(shared, tmp_path):
    recording = shared / 'data' / 'rl_jackal' / 'rl_jackal_mcap'
    if not recording.is_dir():
        pytest.skip('recording rl_jackal is not beside the repository')
    assert main([str(recording), '--output', str(tmp_path)]) == 0
    about = summary(tmp_path)
    assert about['frame'] == 'local'
    assert about['origin'] is None
    with Reader(recording) as reader:
        last = [STORE.deserialize_cdr(data, one.msgtype) for one, _, data in reader.messages()
                if one.msgtype.endswith('Odometry')][-1].pose.pose.position
    assert rows(tmp_path)[-1, 1:3] == pytest.approx([last.x, last.y], abs=0.3)
    with Reader(tmp_path / 'fused') as reader:
        assert {one.topic for one in reader.connections} == {'/odometry/filtered'}


def test_damaged_sensor_csv(tmp_path):
    """What cannot be in a filter is counted; a broken end is told; the rest is used."""
    lines = []
    for step in range(1, 1251):
        time_us = 1_000_000 + 8000 * step
        if step % 5 == 0:
            lines += [f'{time_us},mag,0.21,0.0,0.42', f'{time_us},baro,100.0']
        if step % 100 == 50:
            lines += [f'{time_us},imu,nan,0.0,-9.8,0.0,0.0,0.0', f'{time_us},baro,inf',
                      f'{time_us - 50_000},imu,0.0,0.0,-9.8,0.0,0.0,0.0']
        lines.append(f'{time_us},imu,0.0,0.0,-9.80665,0.0,0.0,0.0')
    path = tmp_path / 'rest.csv'
    path.write_text('\n'.join([*lines, 'broken row']))
    assert run(path, tmp_path / 'out', '--set', 'ekf2.gnss.enabled=false') == 0
    about, table = summary(tmp_path / 'out'), rows(tmp_path / 'out')
    refused = about['topics']['imu']['refused']
    assert refused['not_finite'] > 0
    assert refused['bad_interval'] + refused.get('backward_stamp', 0) > 0
    assert about['topics']['pressure']['refused']['not_finite'] == 13
    assert any('damaged' in note for note in about['notes'])
    assert np.isfinite(table).all()
    assert np.abs(table[:, 4:6]).max() < 0.01
