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
        self.innovation = [0.0] * size
        self.variance = [0.0] * size
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

    def record(
        self, time_us: int, innovation: Sequence[float], variance: Sequence[float],
        test_ratio: float,
    ) -> None:
        """Take down an attempt before its outcome is known."""
        self.time_us = time_us
        self.judged += 1
        self.innovation[:] = innovation
        self.variance[:] = variance
        self.test_ratio = test_ratio

    def judge(
        self, time_us: int, innovation: Sequence[float], variance: Sequence[float],
        test_ratio: float, largest: float = 1.0,
    ) -> bool:
        """Take down an attempt; True, and counted as fused, where its ratio is not too large."""
        self.record(time_us, innovation, variance, test_ratio)
        if test_ratio <= largest:
            self.accept()
            return True
        self.reject()
        return False

    def accept(self) -> None:
        """Count the attempt as fused."""
        self.rejected_last = False
        self.fused += 1
        self.last_fused_us = self.time_us
        if self.first_fused_us == 0:
            self.first_fused_us = self.time_us

    def reject(self) -> None:
        """Count the attempt as rejected."""
        self.rejected_last = True
        self.rejected += 1

    def clear(self, time_us: int) -> None:
        """Forget the innovation of a source that has stopped."""
        size = len(self.innovation)
        self.time_us = time_us
        self.innovation[:] = [0.0] * size
        self.variance[:] = [0.0] * size
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
