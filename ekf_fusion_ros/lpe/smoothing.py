"""What is published, without the steps of corrections."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.lpe.state import SIZE

Array = NDArray[np.float64]


class Smoothing:
    """A first-order low pass on corrections alone.

    PX4 low-passes the published state, which lags behind the vehicle by the time constant. Here a
    correction enters what is published as that low pass would let it in, motion at once.
    """

    def __init__(self) -> None:
        """Nothing is left to enter."""
        self._left = np.zeros(SIZE)

    def note(self, correction: Array) -> None:
        """Take a change of the state (10,) by a measurement."""
        self._left += correction

    def step(self, dt: float, cut_off: float) -> None:
        """Let time pass, s; cut-off in Hz, 0 = everything enters at once."""
        self._left *= math.exp(-2.0 * math.pi * cut_off * dt) if cut_off > 0.0 else 0.0

    def published(self, x: Array) -> Array:
        """Return the state (10,) without what has not entered yet."""
        return x - self._left

    def clear(self) -> None:
        """Let everything enter, as after a jump on request."""
        self._left[:] = 0.0
