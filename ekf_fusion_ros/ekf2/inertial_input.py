"""Inertial input: down-sampling to the filter rate, vibration metrics, rest detection."""

from __future__ import annotations

from collections import deque

import numpy as np

from ekf_fusion_ros.ekf2.filter import DelayedImu
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.kernels.inertial import take_imu
from ekf_fusion_ros.samples import ImuSample

DT_MIN = 1e-4
DT_MAX = 0.02
REST_TIME_US = SECOND
ANGLE_VIBRATION_LIMIT = 1.0 / 4.0e4
VELOCITY_VIBRATION_LIMIT = 1.0 / 2.1e2
RATE_LIMIT = 0.05
NO_CLIPPING = (False, False, False)


class InertialInput:
    """The ring of filter periods between now and the fusion horizon."""

    def __init__(self, length: int, observation_length: int, moving_scaler: float) -> None:
        """Keep `length` filter periods; observation buffers hold `observation_length` samples."""
        self.ring: deque[DelayedImu] = deque(maxlen=length)
        self._observation_length = observation_length
        self._moving_scaler = moving_scaler
        self.dt_avg = 0.0
        self.started = False
        self.last_us = 0
        self.min_interval_us = 0
        self.vibration = np.zeros(3)
        self.at_rest = False
        self.quiet = False
        self._last_move_us = 0
        self._last_vibration_us = 0
        self._previous = np.zeros(6)
        self._quat = np.array((1.0, 0.0, 0.0, 0.0))
        self._velocity = np.zeros(3)
        self._clock = np.zeros(2, dtype=np.float32)
        self._sums = np.zeros(1)
        self._period = np.empty(8)
        self._clipping = NO_CLIPPING
        self._moved = np.zeros(1, dtype=np.bool_)
        self._limits = np.array((ANGLE_VIBRATION_LIMIT * moving_scaler,
                                 VELOCITY_VIBRATION_LIMIT * moving_scaler, 0.0))

    def add(self, sample: ImuSample, in_air: bool) -> bool:
        """Take a raw sample; True when it completed a filter period."""
        dt = min(max(1e-6 * (sample.time_us - self.last_us), DT_MIN), DT_MAX)
        self.started = True
        self.last_us = sample.time_us
        self.dt_avg = 0.8 * self.dt_avg + 0.2 * dt
        self._limits[2] = RATE_LIMIT * self._moving_scaler * dt
        complete = take_imu(
            sample.delta_angle, sample.delta_velocity, sample.delta_angle_dt,
            sample.delta_velocity_dt, self._quat, self._velocity, self._clock, self._sums,
            self._period, self._previous, self.vibration, self._limits, self._moved)
        self._note_rest(sample.time_us, in_air)
        if sample.clipping != NO_CLIPPING:
            x, y, z = (bool(a or b) for a, b in zip(self._clipping, sample.clipping, strict=True))
            self._clipping = (x, y, z)
        if not complete:
            return False
        period, self._period = self._period, np.empty(8)
        self.ring.append(DelayedImu(sample.time_us, period, self._clipping))
        self._clipping = NO_CLIPPING
        span = sample.time_us - self.ring[0].time_us
        self.min_interval_us = span // (self._observation_length - 1)
        return True

    def _note_rest(self, time_us: int, in_air: bool) -> None:
        if self._moved[0]:
            self._last_vibration_us = self._last_move_us = time_us
        elif in_air:
            self._last_move_us = time_us
        self.quiet = time_us - self._last_vibration_us > REST_TIME_US
        self.at_rest = time_us - self._last_move_us > REST_TIME_US


def buffer_lengths(
    max_delay_ms: float, sensor_interval_ms: float, filter_period_ms: float = 10.0,
) -> tuple[int, int]:
    """Return the lengths of the inertial ring and of the observation buffers."""
    imu = int(np.ceil(max_delay_ms / filter_period_ms)) + 1
    observations = int(np.ceil(1.5 * max_delay_ms / sensor_interval_ms))
    return imu, max(2, min(imu, observations))
