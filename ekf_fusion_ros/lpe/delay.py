"""States of the last half second, for measurements that come late."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.lpe.state import SECOND

Array = NDArray[np.float64]

STEP_US = 50_000
LENGTH = 11
DELAY_MAX_US = SECOND // 2


class DelayedStates:
    """One state each 50 ms, straight lines between; the newest end is the present state."""

    def __init__(self) -> None:
        """Start empty."""
        self._past: deque[tuple[int, Array]] = deque(maxlen=LENGTH)

    def note(self, time_us: int, x: Array) -> None:
        """Keep the present state (10,) where the last one kept is 50 ms old."""
        if not self._past or time_us - self._past[-1][0] >= STEP_US:
            self._past.append((time_us, x.copy()))

    def move(self, change: Array) -> None:
        """Add a change (10,) to the whole past, as when the frame moves."""
        for _, x in self._past:
            x += change

    def at(self, time_us: int, now_us: int, x_now: Array) -> Array | None:
        """Return the state (10,) at a time up to half a second ago, None before that.

        A time ahead of now gives the present state.
        """
        if now_us - time_us > DELAY_MAX_US:
            return None
        after_us, after = now_us, x_now
        if time_us >= after_us:
            return after
        for before_us, before in reversed(self._past):
            if before_us <= time_us:
                share = (time_us - before_us) / (after_us - before_us)
                return before + share * (after - before)
            after_us, after = before_us, before
        return None
