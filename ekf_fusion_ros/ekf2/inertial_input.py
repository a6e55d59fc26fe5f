"""Inertial input: down-sampling to the filter rate, vibration metrics, rest detection."""

from __future__ import annotations

from collections import deque

import numpy as np

from ekf_fusion_ros.ekf2.filter import NO_CLIPPING
from ekf_fusion_ros.ekf2.filter import DelayedImu
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.kernels.inertial import COMPLETE
from ekf_fusion_ros.kernels.inertial import INERTIAL
from ekf_fusion_ros.kernels.inertial import MOVED
from ekf_fusion_ros.kernels.inertial import take_imu
from ekf_fusion_ros.samples import ImuSample

DT_MIN = 1e-4
DT_MAX = 0.02
REST_TIME_US = SECOND
ANGLE_VIBRATION_LIMIT = 1.0 / 4.0e4
VELOCITY_VIBRATION_LIMIT = 1.0 / 2.1e2
RATE_LIMIT = 0.05


class InertialInput:
    """The ring of filter periods between now and the fusion horizon."""

    def __init__(self, length: int, observation_length: int, moving_scaler: float) -> None:
        """Keep `length` filter periods; observation buffers hold `observation_length` samples."""
        self.ring: deque[DelayedImu] = deque(maxlen=length)
        self._observation_length = observation_length
        self.dt_avg = 0.0
        self.started = False
        self.last_us = 0
        self.min_interval_us = 0
        self.at_rest = False
        self._last_move_us = 0
        self._last_vibration_us = 0
        self._state = np.zeros(1, INERTIAL)
        self._state['quat'][0, 0] = 1.0
        self.vibration = self._state[0]['vibration']
        self._period = np.empty(8)
        self._clipping = NO_CLIPPING
        self._angle_limit = ANGLE_VIBRATION_LIMIT * moving_scaler
        self._velocity_limit = VELOCITY_VIBRATION_LIMIT * moving_scaler
        self._rate_limit = RATE_LIMIT * moving_scaler

    def add(self, sample: ImuSample, in_air: bool) -> bool:
        """Take a raw sample; True when it completed a filter period."""
        time_us = sample.time_us
        dt = min(max(1e-6 * (time_us - self.last_us), DT_MIN), DT_MAX)
        self.started = True
        self.last_us = time_us
        self.dt_avg = 0.8 * self.dt_avg + 0.2 * dt
        found = take_imu(
            self._state, sample.delta_angle, sample.delta_velocity, sample.delta_angle_dt,
            sample.delta_velocity_dt, self._angle_limit, self._velocity_limit,
            self._rate_limit * dt, self._period)
        if found & MOVED:
            self._last_vibration_us = self._last_move_us = time_us
        elif in_air:
            self._last_move_us = time_us
        self.at_rest = time_us - self._last_move_us > REST_TIME_US
        if sample.clipping != NO_CLIPPING:
            x, y, z = (bool(a or b) for a, b in zip(self._clipping, sample.clipping, strict=True))
            self._clipping = (x, y, z)
        if not found & COMPLETE:
            return False
        period, self._period = self._period, np.empty(8)
        self.ring.append(DelayedImu(time_us, period, self._clipping))
        self._clipping = NO_CLIPPING
        self.min_interval_us = (time_us - self.ring[0].time_us) // (self._observation_length - 1)
        return True

    @property
    def quiet(self) -> bool:
        """True where neither vibration nor rotation has shown for a while."""
        return self.last_us - self._last_vibration_us > REST_TIME_US


def buffer_lengths(
    max_delay_ms: float, sensor_interval_ms: float, filter_period_ms: float = 10.0,
) -> tuple[int, int]:
    """Return the lengths of the inertial ring and of the observation buffers."""
    imu = int(np.ceil(max_delay_ms / filter_period_ms)) + 1
    observations = int(np.ceil(1.5 * max_delay_ms / sensor_interval_ms))
    return imu, max(2, min(imu, observations))
