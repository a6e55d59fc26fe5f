"""Gravity as the accelerometer has it, freed of the motion that velocities tell."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.lpe.state import SECOND

Array = NDArray[np.float64]

LASTS_US = 3 * SECOND // 2
"""Longest time between two windows that are compared, and for which the result is believed."""

HISTORY_US = SECOND


class ForceHistory:
    """The integral (3,) m/s of the specific force in NED over the last second."""

    def __init__(self) -> None:
        """Start at zero."""
        self._integral = np.zeros(3)
        self._past: deque[tuple[int, Array]] = deque()

    def carry(self, time_us: int, step: Array) -> None:
        """Add an increment of velocity (3,) m/s NED that ends at a time."""
        self._integral = self._integral + step
        self._past.append((time_us, self._integral))
        while self._past[0][0] < time_us - HISTORY_US:
            self._past.popleft()

    def at(self, time_us: int) -> Array | None:
        """Return the integral up to the last sample before a time, None beyond the history."""
        count = bisect_right(self._past, time_us, key=itemgetter(0))
        return self._past[count - 1][1] if count else None


class Gravity:
    """Gravity (3,) m/s^2 NED, by how velocity departs from the integrated specific force.

    v - integral of f grows by g t whatever the vehicle does. Its means over successive windows
    tell g, as far as attitude and accelerometer are right: where it does not point down they are
    not.
    """

    def __init__(self, force: ForceHistory, window_us: int) -> None:
        """Compare windows of this length, 0: each velocity with the one before."""
        self._force = force
        self._window_us = window_us
        self._window: list[tuple[int, Array]] = []
        self._before: tuple[float, Array] | None = None
        self._gravity: Array | None = None
        self._last_us = 0

    def note(self, time_us: int, velocity: Array) -> None:
        """Take a velocity (3,) m/s NED that the vehicle had at a time in the last second."""
        integral = self._force.at(time_us)
        if integral is None:
            return
        if self._window and time_us - self._window[-1][0] > LASTS_US:
            self._window.clear()
        self._window.append((time_us, velocity - integral))
        if time_us - self._window[0][0] >= self._window_us:
            self._close(time_us)

    def _close(self, time_us: int) -> None:
        middle = sum(stamp for stamp, _ in self._window) / len(self._window)
        mean = np.mean([departure for _, departure in self._window], axis=0)
        before, self._before = self._before, (middle, mean)
        self._window.clear()
        self._last_us = time_us
        self._gravity = None
        if before is not None and 0.0 < middle - before[0] <= LASTS_US:
            self._gravity = (mean - before[1]) * (SECOND / (middle - before[0]))

    def at(self, now_us: int) -> Array | None:
        """Return gravity, None where nothing has told it lately."""
        return self._gravity if now_us - self._last_us <= LASTS_US else None
