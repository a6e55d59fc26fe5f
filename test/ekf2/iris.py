"""A raw recording replayed as PX4-ECL's own regression test does: sampled and held on 1 ms ticks.

At each tick every row older than it replaces the held value of its sensor; then every sensor whose
period has passed since its last message sends its held value, stamped with the tick. Whether the
vehicle has landed is told at once. The rows of the receiver are read as altitude, latitude,
longitude.
"""

from __future__ import annotations

from collections.abc import Iterator
import csv
from pathlib import Path

import numpy as np

from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import Sample

TICK_US = 1000
PERIODS_US = {'imu': 5000, 'mag': 12500, 'baro': 12500, 'gps': 200000}
HELD_BEFORE_FIRST_ROW = {
    'imu': (0.0, 0.0, -9.80665, 0.0, 0.0, 0.0),
    'mag': (0.2, 0.0, 0.4),
    'baro': (122.2,),
    'gps': (422056.0, 473566094.0, 85190237.0, 0.0, 0.0, 0.0),
}


def read_rows(path: Path) -> list[tuple[int, str, tuple[float, ...]]]:
    """Return time in us, sensor and fields of the rows that are replayed."""
    with path.open(encoding='utf-8', newline='') as stream:
        return [(int(row[0]), row[1], tuple(map(float, row[2:])))
                for row in csv.reader(stream) if row[1] in PERIODS_US or row[1] == 'landed']


def held_messages(
    rows: list[tuple[int, str, tuple[float, ...]]], end_us: int,
) -> Iterator[tuple[int, str, tuple[float, ...], int]]:
    """Yield time, sensor, fields and time since the last message of the sensor, in us.

    The IMU, which drives the filter, comes last among the messages of a tick.
    """
    held = dict(HELD_BEFORE_FIRST_ROW)
    sent = dict.fromkeys(PERIODS_US, 0)
    waiting = iter(rows)
    row = next(waiting, None)
    for now in range(0, end_us, TICK_US):
        while row is not None and row[0] < now:
            if row[1] == 'landed':
                yield now, *row[1:], 0
            else:
                held[row[1]] = row[2]
            row = next(waiting, None)
        for sensor in ('mag', 'baro', 'gps', 'imu'):
            elapsed = now - sent[sensor]
            if elapsed >= PERIODS_US[sensor]:
                sent[sensor] = now
                yield now, sensor, held[sensor], elapsed


def to_sample(time_us: int, sensor: str, v: tuple[float, ...], elapsed_us: int) -> Sample:
    """Return a message as the filter takes it."""
    if sensor == 'imu':
        dt = float(np.float32(np.float32(elapsed_us) * np.float32(1e-6)))
        return ImuSample(time_us, np.array(v[3:6]) * dt, np.array(v[0:3]) * dt, dt, dt)
    if sensor == 'landed':
        return LandedSample(time_us, v[0] != 0.0)
    if sensor == 'mag':
        return MagSample(time_us, np.array(v))
    if sensor == 'baro':
        return BaroSample(time_us, v[0])
    return GnssSample(
        time_us, lat=v[1] * 1e-7, lon=v[2] * 1e-7, alt=v[0] * 1e-3, eph=0.5, epv=0.8,
        velocity=np.array(v[3:6]), sacc=0.2, fix_type=3, nsats=16, pdop=0.0)


def samples(path: Path, end_us: int) -> Iterator[Sample]:
    """Yield what the filter gets from a file up to a time."""
    for message in held_messages(read_rows(path), end_us):
        yield to_sample(*message)
