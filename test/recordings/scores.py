"""Scores of a replay against a recording: used fixes, innovations, recorded attitude.

    python3 test/recordings/scores.py RECORDING REPLAY [--reference CSV] [--delay S]

RECORDING is a rosbag2 folder, REPLAY the output of `replay --log-states`, the reference a CSV
with t_sec, qw..qz (ENU/FLU).
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import pymap3d
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores
from rosbags.typesys import get_typestore

INNOVATIONS = ('gps_vn', 'gps_ve', 'gps_vd', 'gps_pn', 'gps_pe', 'gps_pd', 'baro', 'yaw',
               'magx', 'magy', 'magz', 'tas', 'beta', 'flow_x', 'flow_y', 'hagl', 'rng')


def messages(recording, topic):
    """Yield the messages of a topic, each with its stamp in s as `time`."""
    with AnyReader([Path(recording)], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as bag:
        for connection, _, raw in bag.messages([c for c in bag.connections if c.topic == topic]):
            message = bag.deserialize(raw, connection.msgtype)
            stamp = message.header.stamp
            object.__setattr__(message, 'time', stamp.sec + 1e-9 * stamp.nanosec)
            yield message


def fixes(recording, topic='/fix'):
    """Return stamp s, lat, lon deg, alt m and horizontal sigma m (NaN: unknown), one row each."""
    return np.array([
        (fix.time, fix.latitude, fix.longitude, fix.altitude,
         np.sqrt(fix.position_covariance[0]) if fix.position_covariance_type > 0 else np.nan)
        for fix in messages(recording, topic) if fix.status.status >= 0])


def horizontal_errors(recording, replay, delay, assumed_sigma):
    """Return time and distance in m of trajectory and fix at the time the filter gives it.

    Third, the limit: three of the stated sigma plus 2 m.
    """
    seen = fixes(recording)
    origin = json.loads((Path(replay) / 'summary.json').read_text())['origin']
    east, north, _ = pymap3d.geodetic2enu(
        seen[:, 1], seen[:, 2], np.full(len(seen), origin['alt']),
        origin['lat'], origin['lon'], origin['alt'])
    track = np.genfromtxt(Path(replay) / 'trajectory.csv', delimiter=',', names=True)
    at = seen[:, 0] - delay
    inside = (at >= track['t'][0]) & (at <= track['t'][-1])
    distance = np.hypot(np.interp(at, track['t'], track['x']) - east,
                        np.interp(at, track['t'], track['y']) - north)
    sigma = np.where(np.isfinite(seen[:, 4]), seen[:, 4], assumed_sigma)
    return seen[inside, 0], distance[inside], (3.0 * sigma + 2.0)[inside]


def median_nis(replay):
    """Return the median of innovation^2 / variance by component, over what changed."""
    path = Path(replay) / 'estimator.csv'
    log = np.genfromtxt(path, delimiter=',', names=True)
    medians = {}
    for name in INNOVATIONS:
        if f'i_{name}' not in log.dtype.names or f'iv_{name}' not in log.dtype.names:
            continue
        innovation, variance = log[f'i_{name}'], log[f'iv_{name}']
        fresh = np.append(False, np.diff(innovation) != 0.0) & (variance > 0.0)
        if fresh.sum() > 20:
            medians[name] = float(np.median(innovation[fresh] ** 2 / variance[fresh]))
    return medians


def quaternions(table, names):
    """Return (n, 4) unit quaternions of a table, signs made continuous."""
    q = np.stack([table[name] for name in names], axis=1)
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    flips = np.cumprod(np.where(np.sum(q[1:] * q[:-1], axis=1) < 0.0, -1.0, 1.0))
    q[1:] *= flips[:, None]
    return q


def euler(q):
    """Return roll, pitch, yaw in deg of quaternions (n, 4) in ENU/FLU."""
    w, x, y, z = q.T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.degrees(np.stack([roll, pitch, yaw]))


def at_times(time, table, names):
    """Return (n, k) columns of a table with t_sec, interpolated to times in s."""
    return np.stack([np.interp(time, table['t_sec'], table[name]) for name in names], axis=1)


def angles_between(track, time, names, reference):
    """Return the angle in deg between attitudes of a track and of a reference with t_sec."""
    ours = quaternions(track, names)
    recorded = quaternions(reference, ('qw', 'qx', 'qy', 'qz'))
    theirs = np.stack(
        [np.interp(track[time], reference['t_sec'], column) for column in recorded.T], axis=1)
    theirs /= np.linalg.norm(theirs, axis=1, keepdims=True)
    cosine = np.clip(np.abs(np.sum(ours * theirs, axis=1)), 0.0, 1.0)
    return np.degrees(2.0 * np.arccos(cosine))


def attitude_errors(replay, reference):
    """Return time, angle between the attitudes, and differences in roll, pitch, yaw, in deg."""
    track = np.genfromtxt(Path(replay) / 'trajectory.csv', delimiter=',', names=True)
    recorded = np.genfromtxt(reference, delimiter=',', names=True)
    recorded = recorded[np.isfinite(recorded['qw'])]
    names = ('qw', 'qx', 'qy', 'qz')
    inside = (track['t'] >= recorded['t_sec'][0]) & (track['t'] <= recorded['t_sec'][-1])
    track = track[inside]
    theirs = np.stack([np.interp(track['t'], recorded['t_sec'], column)
                       for column in quaternions(recorded, names).T], axis=1)
    theirs /= np.linalg.norm(theirs, axis=1, keepdims=True)
    differences = euler(quaternions(track, names)) - euler(theirs)
    return (track['t'], angles_between(track, 't', names, recorded),
            (differences + 180.0) % 360.0 - 180.0)


def rms(values):
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def main():
    """Print the scores of one replay."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('recording', type=Path)
    parser.add_argument('replay', type=Path)
    parser.add_argument('--reference', type=Path)
    parser.add_argument('--delay', type=float, default=0.11)
    parser.add_argument('--sigma', type=float, default=1.0, help='where the fix states none')
    options = parser.parse_args()
    for delay in (0.0, options.delay):
        at, distance, limit = horizontal_errors(
            options.recording, options.replay, delay, options.sigma)
        over = distance > limit
        print(f'fixes {delay:.2f} s before their stamp: rms {rms(distance):.2f}, largest '
              f'{distance.max():.2f} m at {at[distance.argmax()] - at[0]:.1f} s, over the limit '
              f'{over.sum()} of {len(over)}, limit {np.median(limit):.1f} m')
    print('NIS ' + ' '.join(f'{k} {v:.2f}' for k, v in median_nis(options.replay).items()))
    if options.reference:
        at, angle, parts = attitude_errors(options.replay, options.reference)
        print(f'attitude rms {rms(angle):.2f} deg, median {np.median(angle):.2f}')
        for name, part in zip(('roll', 'pitch', 'yaw'), parts, strict=True):
            print(f'  {name}: mean {part.mean():.2f}, deviation {part.std():.2f}, '
                  f'rms {rms(part):.2f}')


if __name__ == '__main__':
    main()
