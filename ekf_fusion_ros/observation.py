"""The verdict on one kind of observation."""

from __future__ import annotations

from collections.abc import Sequence

from ekf_fusion_ros.estimator import AidStatus


class Observation:
    """Latest innovation (predicted minus measured), its variance, gate ratio and history."""

    __slots__ = ('_active', 'first_fused_us', 'fused', 'innovation', 'judged', 'last_fused_us',
                 'name', 'rejected', 'rejected_last', 'starts', 'stops', 'test_ratio', 'time_us',
                 'variance')

    def __init__(self, name: str, size: int = 1) -> None:
        """Start with zeros, as a sensor that was never tried."""
        self.name = name
        self.innovation: Sequence[float] = (0.0,) * size
        self.variance: Sequence[float] = (0.0,) * size
        self.test_ratio = 0.0
        self.rejected_last = False
        self.time_us = 0
        self.judged = 0
        self.fused = 0
        self.rejected = 0
        self.first_fused_us = 0
        self.last_fused_us = 0
        self.starts = 0
        self.stops = 0
        self._active = False

    def note(
        self, time_us: int, innovation: Sequence[float], variance: Sequence[float],
        test_ratio: float, passed: bool,
    ) -> bool:
        """Take down an attempt, counted as fused where it has passed; return that."""
        self.time_us = time_us
        self.judged += 1
        self.innovation = innovation
        self.variance = variance
        self.test_ratio = test_ratio
        self.rejected_last = not passed
        if passed:
            self.fused += 1
            self.last_fused_us = time_us
            if self.first_fused_us == 0:
                self.first_fused_us = time_us
        else:
            self.rejected += 1
        return passed

    def clear(self, time_us: int) -> None:
        """Forget the innovation of a source that has stopped."""
        self.time_us = time_us
        self.innovation = self.variance = (0.0,) * len(self.innovation)
        self.test_ratio = 0.0

    def note_active(self, active: bool) -> None:
        """Count changes between in use and not in use."""
        if active and not self._active:
            self.starts += 1
        elif self._active and not active:
            self.stops += 1
        self._active = active

    def status(self) -> AidStatus:
        """Return the record as the outside sees it."""
        return AidStatus(
            self.name, self._active, self.time_us, tuple(self.innovation), tuple(self.variance),
            self.test_ratio, self.rejected_last, self.fused, self.rejected, self.first_fused_us,
            self.last_fused_us, self.starts, self.stops)
