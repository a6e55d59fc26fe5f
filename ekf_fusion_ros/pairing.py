"""Pairs a fix with what comes of it on topics of their own, by stamps alone."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Sequence

from ekf_fusion_ros.messages.decode_fix import FixVelocity
from ekf_fusion_ros.messages.decode_gps_heading import FixHeading
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.statistics import RoleStatistics

Part = FixVelocity | FixHeading


def with_velocity(fix: GnssSample, part: FixVelocity) -> GnssSample:
    """Return a fix with its velocity."""
    return fix._replace(velocity=part.velocity, sacc=part.accuracy)


def with_heading(fix: GnssSample, part: FixHeading) -> GnssSample:
    """Return a fix with the heading of the vehicle."""
    return fix._replace(yaw=part.yaw, yaw_offset=part.offset, yaw_accuracy=part.accuracy)


class FixPairing:
    """Holds a fix until its partner of one role, the next fix or the end of the wait.

    `join` makes one of both. Partners that find no fix are counted as refused, 'unpaired'.
    """

    def __init__(
        self, statistics: RoleStatistics, tolerance_us: int, wait_us: int,
        join: Callable[..., GnssSample],
    ) -> None:
        self._statistics = statistics
        self._tolerance_us = tolerance_us
        self._wait_us = wait_us
        self._join = join
        self._fix: GnssSample | None = None
        self._partners: list[Part] = []

    def push_fix(self, fix: GnssSample) -> list[GnssSample]:
        """Return the fixes that are complete, or will stay without partner."""
        ready = self._release()
        self._fix = fix
        near = [part for part in self._partners if self._matches(part)]
        if near:
            best = min(near, key=lambda part: abs(part.time_us - fix.time_us))
            ready.append(self._pair(best))
        return ready

    def push(self, part: Part) -> list[GnssSample]:
        """Return the waiting fix when this is its partner."""
        self._partners.append(part)
        return [self._pair(part)] if self._matches(part) else []

    @property
    def waiting(self) -> bool:
        """True while a fix or a part of one waits for its partner."""
        return self._fix is not None or bool(self._partners)

    def advance(self, now_us: int) -> Sequence[GnssSample]:
        """Return the fix whose wait is over at inertial time `now_us`."""
        limit = now_us - self._wait_us
        while self._partners and self._partners[0].time_us < limit - self._tolerance_us:
            self._drop(self._partners.pop(0))
        waited = self._fix is not None and self._fix.time_us <= limit
        return self._release() if waited else []

    def flush(self) -> list[GnssSample]:
        """Give up waiting."""
        while self._partners:
            self._drop(self._partners.pop(0))
        return self._release()

    def _matches(self, part: Part) -> bool:
        fix = self._fix
        return fix is not None and abs(part.time_us - fix.time_us) <= self._tolerance_us

    def _pair(self, part: Part) -> GnssSample:
        assert self._fix is not None
        index = self._partners.index(part)
        for passed in self._partners[:index]:
            self._drop(passed)
        del self._partners[:index + 1]
        self._statistics.accepted += 1
        fix, self._fix = self._fix, None
        return self._join(fix, part)

    def _release(self) -> list[GnssSample]:
        fix, self._fix = self._fix, None
        return [] if fix is None else [fix]

    def _drop(self, part: Part) -> None:
        self._statistics.refuse(
            'unpaired', f'the message of {part.time_us / 1e6:.6f} s has no fix of that stamp')
