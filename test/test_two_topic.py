"""Odometry and fixes alone, on recordings of real vehicles, with default parameters."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rosbags')
pymap3d = pytest.importorskip('pymap3d')

DATA = Path(__file__).resolve().parents[1] / '..' / 'shared' / 'data'
HUSKY = DATA / 'rl_husky' / 'rl_husky_mcap'
ROVER = (DATA / 'rover_canada_openvins_gps_imu' / 'rover_canada_openvins_gps_imu_mcap')
ROVER_POSE = DATA / 'rover_canada_openvins_gps_imu' / 'reference' / 'global_pose_enu.csv'
HUSKY_GAPS = ((60, 80), (120, 140), (180, 200), (240, 260), (300, 320), (360, 380))
ROVER_GAPS = tuple((start, start + 20) for start in range(60, 301, 40))


def read(recording, odometry_topic):
    """Return start time, fixes (t, lat, lon, alt) and odometry (t, x, y)."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores
    from rosbags.typesys import get_typestore
    fixes, odometry = [], []
    with AnyReader([recording], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        wanted = [c for c in reader.connections if c.topic in ('/fix', odometry_topic)]
        for connection, _, raw in reader.messages(wanted):
            message = reader.deserialize(raw, connection.msgtype)
            stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
            if connection.topic == '/fix':
                fixes.append((stamp, message.latitude, message.longitude, message.altitude))
            else:
                place = message.pose.pose.position
                odometry.append((stamp, place.x, place.y))
        return 1e-9 * reader.start_time, np.array(fixes), np.array(odometry)


def replay(recording, folder, gaps):
    from ekf_fusion_ros.replay.cli import main
    windows = ','.join(f'{start}:{end}' for start, end in gaps)
    arguments = [str(recording), '--output', str(folder), '--no-bag']
    assert main(arguments + (['--withhold', f'fix={windows}'] if gaps else [])) == 0
    track, alignment = (
        np.genfromtxt(folder / name, delimiter=',', names=True)
        for name in ('trajectory.csv', 'alignment.csv'))
    return json.loads((folder / 'summary.json').read_text()), track, alignment


def errors(summary, track, fixes):
    """Return horizontal distance to every fix; NaN outside the track."""
    origin = summary['origin']
    east, north, _ = pymap3d.geodetic2enu(
        fixes[:, 1], fixes[:, 2], fixes[:, 3], origin['lat'], origin['lon'], origin['alt'])
    x, y = (np.interp(fixes[:, 0], track['t'], track[axis], np.nan, np.nan) for axis in 'xy')
    return np.hypot(x - east, y - north), east + 1j * north


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def gap_scores(error, seconds, gaps):
    """Return gap RMS, RMS of the last second, largest error, RMS outside."""
    inside = [(seconds >= start) & (seconds < end) for start, end in gaps]
    ends = [error[held & (seconds >= gap[1] - 1)]
            for held, gap in zip(inside, gaps, strict=True)]
    used = ~np.any(inside, axis=0) & np.isfinite(error)
    return (rms([rms(error[held]) for held in inside]), rms([rms(end) for end in ends]),
            max(error[held].max() for held in inside), rms(error[used]))


def heading_errors(alignment, fixes, places, odometry):
    """Return degrees against rigid fits of odometry to fixes over the surrounding 30 s."""
    x, y = (np.interp(fixes[:, 0], odometry[:, 0], odometry[:, axis]) for axis in (1, 2))
    moved, found = x + 1j * y, []
    for time, yaw in zip(alignment['t'], alignment['odom_yaw'], strict=True):
        near = np.abs(fixes[:, 0] - time) <= 15.0
        if np.abs(np.diff(moved[near])).sum() > 5.0:
            a, b = (value[near] - value[near].mean() for value in (moved, places))
            found.append((time, np.angle(np.exp(1j * yaw) / (a.conj() @ b), deg=True)))
    return np.array(found)


@pytest.mark.skipif(not HUSKY.exists(), reason='needs ../shared/data/rl_husky')
@pytest.mark.parametrize('gaps', [HUSKY_GAPS, ()], ids=['gaps', 'whole'])
def test_wheel_odometry_bridges_gaps_and_keeps_its_heading(tmp_path, gaps):
    start, fixes, odometry = read(HUSKY, '/husky_velocity_controller/odom')
    summary, track, alignment = replay(HUSKY, tmp_path, gaps)
    error, places = errors(summary, track, fixes)
    if gaps:
        gap_rms, end, largest, used = gap_scores(error, fixes[:, 0] - start, gaps)
        assert gap_rms <= 3.8
        assert end <= 5.0
        assert largest <= 8.5
        assert used <= 2.5
    heading = heading_errors(alignment, fixes, places, odometry)
    settled = heading[heading[:, 0] - start >= 25.0]
    assert len(settled) > 340
    assert np.abs(settled[:, 1]).max() <= 15.0


@pytest.mark.skipif(not ROVER.exists(), reason=f'needs ../shared/data/{ROVER.parent.name}')
@pytest.mark.parametrize('gaps', [ROVER_GAPS, ()], ids=['gaps', 'whole'])
def test_odometry_without_orientation_fuses(tmp_path, gaps):
    start, fixes, _ = read(ROVER, '/odom')
    summary, track, alignment = replay(ROVER, tmp_path, gaps)
    error, _ = errors(summary, track, fixes)
    if gaps:
        gap_rms, end, largest, _ = gap_scores(error, fixes[:, 0] - start, gaps)
        assert gap_rms <= 0.75
        assert end <= 0.80
        assert largest <= 2.6
    pose = np.genfromtxt(ROVER_POSE, delimiter=',', names=True)
    time = pose['t_sec'] - 1.3
    on_track = (time >= track['t'][0]) & (time <= track['t'][-1])
    apart = [np.interp(time[on_track], track['t'], track[axis]) - pose[name][on_track]
             for axis, name in (('x', 'east'), ('y', 'north'))]
    assert np.hypot(np.std(apart[0]), np.std(apart[1])) <= 0.80
    assert alignment['t'][0] - start <= 35.0
    settled = alignment['odom_yaw'][alignment['t'] - start >= 35.0]
    spread = np.angle(np.exp(1j * (settled - settled[-1])), deg=True)
    assert np.abs(spread).max() <= 10.0
    assert abs(np.degrees(settled[-1]) + 105.5) <= 10.0
