"""sensor_msgs/Imu to readings, and readings to the increments that the estimator takes."""

from __future__ import annotations

from collections.abc import Sequence
import itertools
from itertools import repeat
import math
from typing import Any
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros import frames
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.flat import FlatMessage
from ekf_fusion_ros.messages.flat import FlatRows
from ekf_fusion_ros.messages.flat import elements
from ekf_fusion_ros.messages.flat import flat_message
from ekf_fusion_ros.messages.flat import named
from ekf_fusion_ros.messages.flat import where_good
from ekf_fusion_ros.messages.flat import xyz
from ekf_fusion_ros.messages.flat import xyzw
from ekf_fusion_ros.messages.mounting import body_to_sensor_quaternion
from ekf_fusion_ros.messages.mounting import turned_to_body
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import checked_stamp
from ekf_fusion_ros.messages.stamps import plain_stamps
from ekf_fusion_ros.params.messages import ZERO
from ekf_fusion_ros.params.messages import ImuMessageParams
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import NO_CLIPPING
from ekf_fusion_ros.samples import ImuSample

Array = NDArray[np.float64]

ABSENT = -1.0
USUAL_OF = 25
"""Intervals whose median is the usual one."""

MISSING_FROM = 1.5
"""Multiple of the usual interval above which readings are missing."""

SLOW_US, PART_US = 12_000, 5_000
"""Interval above which a reading is split, and the longest part: the covariance of the filter
counts periods of 10 ms, whatever they last."""

# Places in the flat message, each vector before its covariance.
ORIENTATION, ORIENTATION_COVARIANCE = slice(0, 4), 4
RATE, RATE_COVARIANCE = slice(13, 16), 16
FORCE, FORCE_COVARIANCE = slice(25, 28), 28


class ImuReading(NamedTuple):
    """Rate (3,) rad/s and specific force (3,) m/s^2 in body FRD at a stamp.

    orientation (4,) w, x, y, z body FRD to NED, None where the message has none. increment: what
    the reading amounts to since the stamp since_us, where that was computed beforehand.
    """

    time_us: int
    rate: Sequence[float]
    specific_force: Sequence[float]
    orientation: Array | None = None
    increment: ImuSample | None = None
    since_us: int = -1


def decode_imu(message: Any, params: MessageParams) -> ImuReading:
    """Return an Imu message as a reading, by REP-145.

    A first covariance element of -1 means that the field is absent, all zero that its noise is
    unknown. An orientation that is not a rotation counts as absent. Raises Refused, also where
    the angular velocity or the acceleration is absent.
    """
    flat = message if isinstance(message, FlatMessage) else _flat(message)
    sec, nanosec, frame_id, numbers, _ = flat
    imu = params.imu
    time_us = checked_stamp(sec, nanosec)
    _check_present(numbers, RATE_COVARIANCE, 'angular_velocity')
    _check_present(numbers, FORCE_COVARIANCE, 'linear_acceleration')
    rate, force = numbers[RATE], numbers[FORCE]
    fields.check_vector(rate, 'angular_velocity', imu.max_rate)
    fields.check_vector(force, 'linear_acceleration', imu.max_acceleration)
    orientation = None
    if numbers[ORIENTATION_COVARIANCE] != ABSENT:
        orientation = _orientation(numbers[ORIENTATION], frame_id, imu)
    return ImuReading(
        time_us, turned_to_body(rate, imu.mount_rpy, frame_id),
        turned_to_body(force, imu.mount_rpy, frame_id), orientation)


def decode_imu_rows(rows: FlatRows, params: MessageParams) -> list[ImuReading | None]:
    """Return Imu messages as readings, None for each that `decode_imu` has to look at.

    The numbers are those of `decode_imu`; what is not plainly good is left to it, which knows
    why it refuses.
    """
    imu, columns = params.imu, rows.numbers.T
    times, good = plain_stamps(rows.sec, rows.nanosec)
    for name, limit in ((RATE, imu.max_rate), (FORCE, imu.max_acceleration)):
        good &= (np.abs(columns[name]) <= limit).all(axis=0)
    for first in (RATE_COVARIANCE, FORCE_COVARIANCE):
        good &= (columns[first:first + 9:4] >= 0.0).all(axis=0)
    present = good & (columns[ORIENTATION_COVARIANCE] != ABSENT)
    columns = np.where(good, columns, 0.0)
    rates, forces = (
        np.stack(turned_to_body(columns[name], imu.mount_rpy, rows.frame_id), axis=1)
        for name in (RATE, FORCE))
    orientations: list[Array | None] = [None] * len(times)
    for k in np.flatnonzero(present).tolist():
        orientations[k] = _orientation(
            rows.numbers[k, ORIENTATION].tolist(), rows.frame_id, imu)
    # Most readings follow the one before them here, so that their increments are known already.
    intervals = np.diff(times, prepend=times[:1]) * 1e-6
    angles, velocities = rates * intervals[:, None], forces * intervals[:, None]
    stamps, dt = times.tolist(), intervals.tolist()
    increments = named(ImuSample, zip(
        stamps, angles, velocities, dt, dt, repeat(NO_CLIPPING), orientations, strict=False))
    readings = named(ImuReading, zip(
        stamps, rates, forces, orientations, increments, [-1, *stamps[:-1]], strict=True))
    return where_good(readings, good)


def _flat(message: Any) -> FlatMessage:
    numbers: list[float] = []
    for name, values in (('orientation', xyzw), ('angular_velocity', xyz),
                         ('linear_acceleration', xyz)):
        covariance = f'{name}_covariance'
        numbers += values(getattr(message, name))
        numbers += elements(getattr(message, covariance), 9, covariance)
    return flat_message(message, numbers)


class ImuIntegrator:
    """Turns readings into increments: each reading holds over the interval that it ends.

    That is exact for sensors that publish means over their interval, as autopilots do. An interval
    much longer than the usual one means that readings are missing (loggers and best-effort topics
    lose some): they are interpolated between their neighbours. `gaps` counts the intervals above
    `max_gap`; such a one is not filled at all but counts as one ordinary interval. The intervals
    of an IMU that is slower than the filter are split.
    """

    def __init__(self, params: MessageParams) -> None:
        """Take `imu.max_gap`, the longest interval that is bridged."""
        self._max_gap_us = round(params.imu.max_gap * 1e6)
        self.gaps = 0
        self.reset()

    def reset(self) -> None:
        """Forget the last reading; the count of gaps stays."""
        self._interval_us = 0
        self._before: ImuReading | None = None
        self._steps_us: list[int] = []
        self._usual_us = 0
        self._longest_us = 0

    def push(self, reading: ImuReading) -> list[ImuSample]:
        """Return the increments up to this reading, none for the first.

        Raises Refused 'repeated_stamp' or 'backward_stamp' when time does not advance.
        """
        before = self._before
        if before is None:
            self._before = reading
            return []
        before_us = before.time_us
        step_us = reading.time_us - before_us
        if step_us <= 0:
            reason = 'backward_stamp' if step_us else 'repeated_stamp'
            raise Refused(reason, f'header.stamp is {-step_us} us before the last reading')
        self._before = reading
        if step_us > self._max_gap_us:
            self.gaps += 1
            return _parts(_increments(reading, self._interval_us or self._max_gap_us))
        self._interval_us = step_us
        if 0 < self._longest_us < step_us:
            samples = self._bridge(before, reading)
        elif reading.since_us == before_us and reading.increment is not None:
            samples = [reading.increment]
        else:
            samples = [_increments(reading, step_us)]
        if step_us > SLOW_US:
            samples = [part for sample in samples for part in _parts(sample)]
        steps_us = self._steps_us
        steps_us.append(step_us)
        if len(steps_us) == USUAL_OF:
            self._learn_usual_interval()
        return samples

    def _bridge(self, before: ImuReading, reading: ImuReading) -> list[ImuSample]:
        """Return increments at the usual interval, along the line between two readings."""
        step_us = reading.time_us - before.time_us
        count = round(step_us / self._usual_us)
        old = (*before.rate, *before.specific_force)
        new = (*reading.rate, *reading.specific_force)
        samples, last_us = [], before.time_us
        for k in range(1, count + 1):
            time_us = before.time_us + step_us * k // count
            between = [a + (b - a) * k / count for a, b in zip(old, new, strict=True)]
            orientation = reading.orientation if k == count else None
            samples.append(
                _increments(ImuReading(time_us, between[0:3], between[3:6], orientation),
                            time_us - last_us))
            last_us = time_us
        return samples

    def _learn_usual_interval(self) -> None:
        """Take the median of some intervals; later of the next ones."""
        self._usual_us = sorted(self._steps_us)[USUAL_OF // 2]
        self._longest_us = round(MISSING_FROM * self._usual_us)
        self._steps_us.clear()


def _increments(reading: ImuReading, step_us: int) -> ImuSample:
    dt = step_us * 1e-6
    return ImuSample(
        reading.time_us, np.multiply(reading.rate, dt), np.multiply(reading.specific_force, dt),
        dt, dt, orientation=reading.orientation)


def _parts(sample: ImuSample) -> list[ImuSample]:
    """Return a sample in equal parts, as it is where it is short enough."""
    step_us = round(1e6 * sample.delta_velocity_dt)
    if step_us <= SLOW_US:
        return [sample]
    count = math.ceil(step_us / PART_US)
    ends_us = [step_us * k // count for k in range(count + 1)]
    parts = []
    for begin_us, end_us in itertools.pairwise(ends_us):
        share = (end_us - begin_us) / step_us
        dt = share * sample.delta_velocity_dt
        parts.append(ImuSample(
            sample.time_us - step_us + end_us, share * sample.delta_angle,
            share * sample.delta_velocity, dt, dt,
            orientation=sample.orientation if end_us == step_us else None))
    return parts


def _check_present(numbers: Sequence[float], first: int, name: str) -> None:
    if numbers[first] >= 0.0 and numbers[first + 4] >= 0.0 and numbers[first + 8] >= 0.0:
        return
    covariance = numbers[first:first + 9]
    if covariance[0] == ABSENT:
        raise Refused(
            f'no_{name}', f'{name}_covariance[0] is -1: the message carries no {name}')
    fields.check_variances(covariance, (0, 4, 8), f'{name}_covariance')


def _orientation(
        xyzw: Sequence[float], frame_id: str, params: ImuMessageParams) -> Array | None:
    try:
        quaternion = fields.unit_quaternion(xyzw, 'orientation')
    except Refused:
        return None
    if frames.frame_kind(frame_id) == 'enu':
        quaternion = frames.swap_attitude(quaternion)
    if params.mount_rpy != ZERO:
        quaternion = quat_multiply(quaternion, body_to_sensor_quaternion(params.mount_rpy))
    return quaternion
