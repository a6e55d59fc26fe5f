"""Averaging of fast scalar and vector sensors down to the rate of their buffer."""

from __future__ import annotations

from typing import Generic
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.state import FILTER_PERIOD_US

Value = TypeVar('Value', float, NDArray[np.float64])


class SampleAverage(Generic[Value]):
    """Mean of all samples, numbers or vectors, since the last one that was handed on."""

    def __init__(self, nothing: Value) -> None:
        """Begin a sum with `nothing`."""
        self._nothing: Value = nothing
        self._sum: Value = nothing
        self._milliseconds = 0
        self._count = 0
        self._accepted_us = 0

    def add(
        self, time_us: int, value: Value, min_interval_us: int, delay_us: int,
    ) -> tuple[int, Value] | None:
        """Add a sample; return time at the sensor and mean once the interval has passed.

        Stamps are averaged in whole milliseconds; half a filter period is taken off because the
        sample belongs to the middle of the period that the horizon crosses.
        """
        due = time_us - self._accepted_us > min_interval_us
        if due and self._count == 0:
            # mostly a sensor is no faster than its buffer: one sample is its own mean
            self._accepted_us = time_us
            return 1000 * (time_us // 1000) - delay_us - FILTER_PERIOD_US // 2, value
        self._sum = self._sum + value
        self._milliseconds += time_us // 1000
        self._count += 1
        if not due:
            return None
        mean = self._sum / self._count
        stamp = 1000 * (self._milliseconds // self._count)
        self._sum = self._nothing
        self._milliseconds = 0
        self._count = 0
        self._accepted_us = time_us
        return stamp - delay_us - FILTER_PERIOD_US // 2, mean
