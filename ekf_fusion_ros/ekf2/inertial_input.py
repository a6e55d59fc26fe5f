"""Inertial input: down-sampling to the filter rate, vibration metrics, rest detection."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.delayed_imu import NO_CLIPPING
from ekf_fusion_ros.ekf2.delayed_imu import DelayedImu
from ekf_fusion_ros.ekf2.output_predictor import OutputPredictor
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.kernels.inertial import COMPLETE
from ekf_fusion_ros.kernels.inertial import INERTIAL
from ekf_fusion_ros.kernels.inertial import MOVED
from ekf_fusion_ros.kernels.period import take_raw
from ekf_fusion_ros.samples import ImuSample

Array = NDArray[np.float64]

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
        self._last_move_us = 0
        self._last_vibration_us = 0
        self._state = np.zeros(1, INERTIAL)
        state = self._state[0]
        state['quat'][0] = 1.0
        state['limits'] = moving_scaler * np.array(
            (ANGLE_VIBRATION_LIMIT, VELOCITY_VIBRATION_LIMIT, RATE_LIMIT))
        self.vibration = state['vibration']
        self._period = state['period']
        self._clipping = NO_CLIPPING

    def add(self, sample: ImuSample, in_air: bool, output: OutputPredictor, x: Array,
            dt_avg: float) -> bool:
        """Take a raw sample; True when it completed a filter period.

        Any other carries the output predictor on; x (24,), dt_avg mean filter period in s.
        """
        time_us = sample.time_us
        dt = min(max(1e-6 * (time_us - self.last_us), DT_MIN), DT_MAX)
        self.last_us = time_us
        self.dt_avg = dt_imu = 0.8 * self.dt_avg + 0.2 * dt
        found = take_raw(
            self._state, output.state, x, sample.delta_angle, sample.delta_velocity,
            sample.delta_angle_dt, sample.delta_velocity_dt, dt, dt_imu / dt_avg)
        if found & MOVED:
            self._last_vibration_us = self._last_move_us = time_us
        elif in_air:
            self._last_move_us = time_us
        if sample.clipping != NO_CLIPPING:
            before = self._clipping
            first, second, third = (
                bool(a or b) for a, b in zip(before, sample.clipping, strict=True))
            self._clipping = (first, second, third)
        if not found & COMPLETE:
            return False
        self.ring.append(DelayedImu(time_us, self._period.copy(), self._clipping))
        self._clipping = NO_CLIPPING
        self.min_interval_us = (time_us - self.ring[0].time_us) // (self._observation_length - 1)
        return True

    @property
    def at_rest(self) -> bool:
        """True where nothing has moved for a while."""
        return self.last_us - self._last_move_us > REST_TIME_US

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
