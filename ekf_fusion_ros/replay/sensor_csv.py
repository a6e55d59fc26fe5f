"""Sensor CSV recordings: one row per message, in the order in which the filter gets them.

`time_us,sensor,field,...`; the fields of each sensor are those of the constructors below. Time is
in integer us; body axes FRD, earth axes NED.
"""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterator
import csv
import gzip
import math
from pathlib import Path

import numpy as np

from ekf_fusion_ros.samples import NO_CLIPPING
from ekf_fusion_ros.samples import AirspeedSample
from ekf_fusion_ros.samples import AuxVelocitySample
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import FlowSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import RangeSample
from ekf_fusion_ros.samples import Sample
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.samples import VisionSample

Fields = list[float]


class SensorCsvError(ValueError):
    """A file that is not a sensor CSV; the message names file and row."""


def _mag(time_us: int, v: Fields) -> Sample:
    return MagSample(time_us, np.array(v[0:3]))


def _baro(time_us: int, v: Fields) -> Sample:
    return BaroSample(time_us, v[0])


def _gps(time_us: int, v: Fields) -> Sample:
    yaw, offset = (v[12], v[13]) if len(v) > 13 else (math.nan, 0.0)
    return GnssSample(
        time_us, lat=v[1] * 1e-7, lon=v[2] * 1e-7, alt=v[0] * 1e-3, velocity=np.array(v[3:6]),
        fix_type=int(v[6]), eph=v[7], epv=v[8], sacc=v[9], nsats=int(v[10]), pdop=v[11], yaw=yaw,
        yaw_offset=offset)


def _airspeed(time_us: int, v: Fields) -> Sample | None:
    if min(v[0:2]) <= float(np.finfo(np.float32).eps):
        return None
    return AirspeedSample(time_us, v[0], v[0] / v[1])


def _range(time_us: int, v: Fields) -> Sample:
    return RangeSample(time_us, v[0], int(v[1]))


def _flow(time_us: int, v: Fields) -> Sample:
    return FlowSample(time_us, np.array(v[0:2]), np.array(v[2:5]), int(v[5]), v[6])


def _vio(time_us: int, v: Fields) -> Sample:
    covariance = np.diag(v[13:16])
    if len(v) > 20:
        xy, xz, yz = v[18:21]
        covariance = covariance + np.array(((0.0, xy, xz), (xy, 0.0, yz), (xz, yz, 0.0)))
    return VisionSample(
        time_us, position=np.array(v[0:3]), quaternion=np.array(v[3:7]),
        velocity=np.array(v[7:10]),
        position_var=np.array(v[10:13]), velocity_cov=covariance, angular_var=v[16],
        velocity_frame=VelocityFrame(int(v[17])))


def _auxvel(time_us: int, v: Fields) -> Sample:
    return AuxVelocitySample(time_us, np.array(v[0:3]), np.array(v[3:6]))


READERS: dict[str, tuple[int, Callable[[int, Fields], Sample | None]]] = {
    'mag': (3, _mag),
    'baro': (1, _baro),
    'gps': (12, _gps),
    'airspeed': (2, _airspeed),
    'range': (2, _range),
    'flow': (7, _flow),
    'vio': (18, _vio),
    'ev': (18, _vio),
    'auxvel': (6, _auxvel),
}


class _ImuRows:
    """Turns mean rate and force into increments over the gap to the row before.

    The first row takes the gap to the second, so it has to wait for it.
    """

    def __init__(self) -> None:
        self._last_us: int | None = None

    def sample(self, time_us: int, v: Fields, next_us: int) -> Sample:
        gap = next_us - time_us if self._last_us is None else time_us - self._last_us
        self._last_us = time_us
        # single precision as the reference filter has it: ties in the down-sampler hang on it
        dt = float(np.float32(np.float32(gap) * np.float32(1e-6)))
        clipping = (v[6] != 0, v[7] != 0, v[8] != 0) if len(v) > 8 else NO_CLIPPING
        return ImuSample(time_us, np.array(v[3:6]) * dt, np.array(v[0:3]) * dt, dt, dt, clipping)


def _rows(path: Path) -> Iterator[tuple[int, str, Fields]]:
    opener = gzip.open if path.suffix == '.gz' else open
    with opener(path, 'rt', encoding='utf-8', newline='') as stream:
        for number, row in enumerate(csv.reader(stream), start=1):
            if not row or row[0].startswith('#'):
                continue
            try:
                yield int(row[0]), row[1], [float(x) for x in row[2:]]
            except (ValueError, IndexError) as error:
                raise SensorCsvError(
                    f'{path.name}: row {number} is not "time_us,sensor,field,..." ({error})'
                ) from error


def read_sensor_csv(path: Path, *, vehicle: dict[str, str] | None = None) -> Iterator[Sample]:
    """Yield the samples of a file in its order.

    `vehicle` holds the flags passed with every landed row (fixed_wing, fuse_beta). Raises
    SensorCsvError on a malformed row.
    """
    vehicle = vehicle or {}
    fixed_wing = float(vehicle.get('fixed_wing', 0)) != 0
    fuse_beta = float(vehicle.get('fuse_beta', 0)) != 0
    next_imu_us = _second_imu_time(path)
    imu = _ImuRows()
    for time_us, sensor, v in _rows(path):
        if sensor == 'imu':
            _require(path, sensor, v, 6)
            yield imu.sample(time_us, v, next_imu_us)
        elif sensor == 'landed':
            _require(path, sensor, v, 1)
            yield LandedSample(time_us, v[0] != 0, fixed_wing, fuse_beta)
        elif sensor in READERS:
            count, reader = READERS[sensor]
            _require(path, sensor, v, count)
            sample = reader(time_us, v)
            if sample is not None:
                yield sample
        else:
            raise SensorCsvError(f'{path.name}: unknown sensor "{sensor}"')


def _require(path: Path, sensor: str, v: Fields, count: int) -> None:
    if len(v) < count:
        raise SensorCsvError(f'{path.name}: a row of {sensor} has {len(v)} of {count} fields')


def _second_imu_time(path: Path) -> int:
    times = (time_us for time_us, sensor, _ in _rows(path) if sensor == 'imu')
    first = next(times, None)
    if first is None:
        raise SensorCsvError(f'{path.name}: no imu row')
    return next(times, first + 5000)
