"""Pairs a fix with the velocity that comes on a topic of its own, by stamps alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ekf_fusion_ros.messages.decode_fix import FixVelocity
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.statistics import RoleStatistics


class FixPairing:
    """Holds a fix until its velocity, the next fix or the end of the wait.

    Velocities that find no fix are counted as refused, 'unpaired'.
    """

    def __init__(self, statistics: RoleStatistics, tolerance_us: int, wait_us: int) -> None:
        self._statistics = statistics
        self._tolerance_us = tolerance_us
        self._wait_us = wait_us
        self._fix: GnssSample | None = None
        self._velocities: list[FixVelocity] = []

    def push_fix(self, fix: GnssSample) -> list[GnssSample]:
        """Return the fixes that are complete, or will stay without velocity."""
        ready = self._release()
        self._fix = fix
        near = [v for v in self._velocities if self._matches(v)]
        if near:
            best = min(near, key=lambda v: abs(v.time_us - fix.time_us))
            ready.append(self._pair(best))
        return ready

    def push_velocity(self, velocity: FixVelocity) -> list[GnssSample]:
        """Return the waiting fix when this is its velocity."""
        self._velocities.append(velocity)
        return [self._pair(velocity)] if self._matches(velocity) else []

    @property
    def waiting(self) -> bool:
        """True while a fix or a velocity waits for its partner."""
        return self._fix is not None or bool(self._velocities)

    def advance(self, now_us: int) -> Sequence[GnssSample]:
        """Return the fix whose wait is over at inertial time `now_us`."""
        limit = now_us - self._wait_us
        while self._velocities and self._velocities[0].time_us < limit - self._tolerance_us:
            self._drop(self._velocities.pop(0))
        waited = self._fix is not None and self._fix.time_us <= limit
        return self._release() if waited else []

    def flush(self) -> list[GnssSample]:
        """Give up waiting."""
        while self._velocities:
            self._drop(self._velocities.pop(0))
        return self._release()

    def _matches(self, velocity: FixVelocity) -> bool:
        fix = self._fix
        return fix is not None and abs(velocity.time_us - fix.time_us) <= self._tolerance_us

    def _pair(self, velocity: FixVelocity) -> GnssSample:
        assert self._fix is not None
        index = self._velocities.index(velocity)
        for passed in self._velocities[:index]:
            self._drop(passed)
        del self._velocities[:index + 1]
        self._statistics.accepted += 1
        fix, self._fix = self._fix, None
        return replace(fix, velocity=velocity.velocity, sacc=velocity.accuracy)

    def _release(self) -> list[GnssSample]:
        fix, self._fix = self._fix, None
        return [] if fix is None else [fix]

    def _drop(self, velocity: FixVelocity) -> None:
        self._statistics.refuse(
            'unpaired', f'velocity of {velocity.time_us / 1e6:.6f} s has no fix of that stamp')
