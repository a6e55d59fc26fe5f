"""Inertial input: down-sampling to the filter rate, vibration metrics, rest detection."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.admission import not_finite
from ekf_fusion_ros.ekf2.delayed_imu import DelayedImu
from ekf_fusion_ros.ekf2.output_predictor import OutputPredictor
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.kernels.compile import machine_code
from ekf_fusion_ros.kernels.inertial import INERTIAL
from ekf_fusion_ros.kernels.period import NOT_FINITE
from ekf_fusion_ros.kernels.period import TAKEN
from ekf_fusion_ros.kernels.period import take_raw
from ekf_fusion_ros.samples import NO_CLIPPING
from ekf_fusion_ros.samples import ImuSample

Array = NDArray[np.float64]

REST_TIME_US = SECOND
ANGLE_VIBRATION_LIMIT = 1.0 / 4.0e4
VELOCITY_VIBRATION_LIMIT = 1.0 / 2.1e2
RATE_LIMIT = 0.05


class InertialInput:
    """The ring of filter periods between now and the fusion horizon.

    `state` is one INERTIAL, with the newest raw sample in it;
    `at_rest` where nothing has moved for a while, `quiet` where neither vibration nor rotation has
    shown: both as of the last complete period.
    """

    def __init__(self, length: int, observation_length: int, moving_scaler: float) -> None:
        """Keep `length` filter periods; observation buffers hold `observation_length` samples."""
        self.ring: deque[DelayedImu] = deque(maxlen=length)
        self._observation_length = observation_length
        self.started = False
        self.min_interval_us = 0
        self.at_rest = False
        self.quiet = False
        self.state = np.zeros(1, INERTIAL)
        state = self.state[0]
        state['quat'][0] = 1.0
        state['limits'] = moving_scaler * np.array(
            (ANGLE_VIBRATION_LIMIT, VELOCITY_VIBRATION_LIMIT, RATE_LIMIT))
        self.vibration = state['vibration']
        self._times = state['times']
        self._period = state['period']
        self._clipping = NO_CLIPPING
        self._take_raw = machine_code(take_raw)

    def add(self, sample: ImuSample, in_air: bool, output: OutputPredictor, x: Array,
            dt_avg: float) -> bool:
        """Take a raw sample; True when it completed a filter period.

        Any other carries the output predictor on; x (24,), dt_avg mean filter period in s. Its
        arrays must be those of `admitted_imu`. Raises ValueError for numbers that are not finite.
        """
        time_us, angle, velocity, angle_dt, velocity_dt, clipping, _ = sample
        outcome = self._take_raw(
            self.state, output.state, x, time_us, angle, velocity, angle_dt, velocity_dt, dt_avg,
            in_air)
        if outcome == NOT_FINITE:
            raise not_finite(sample)
        if clipping != NO_CLIPPING:
            before = self._clipping
            first, second, third = (
                bool(a or b) for a, b in zip(before, clipping, strict=True))
            self._clipping = (first, second, third)
        if outcome == TAKEN:
            return False
        self.ring.append(DelayedImu(time_us, self._period.copy(), self._clipping))
        self._clipping = NO_CLIPPING
        last, motion, vibration = self._times.tolist()
        self.at_rest = last - motion > REST_TIME_US
        self.quiet = last - vibration > REST_TIME_US
        self.min_interval_us = (time_us - self.ring[0].time_us) // (self._observation_length - 1)
        return True


def buffer_lengths(
    max_delay_ms: float, sensor_interval_ms: float, filter_period_ms: float = 10.0,
) -> tuple[int, int]:
    """Return the lengths of the inertial ring and of the observation buffers."""
    imu = int(np.ceil(max_delay_ms / filter_period_ms)) + 1
    observations = int(np.ceil(1.5 * max_delay_ms / sensor_interval_ms))
    return imu, max(2, min(imu, observations))
