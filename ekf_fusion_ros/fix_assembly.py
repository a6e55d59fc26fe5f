"""Puts a fix together from its topics: position, velocity, heading."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Collection
from collections.abc import Mapping
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ekf_fusion_ros.pairing import FixPairing
from ekf_fusion_ros.pairing import Part
from ekf_fusion_ros.pairing import with_heading
from ekf_fusion_ros.pairing import with_velocity
from ekf_fusion_ros.roles import FIX_OF_PART
from ekf_fusion_ros.roles import FIX_VELOCITY
from ekf_fusion_ros.roles import FIX_VELOCITY_2
from ekf_fusion_ros.roles import FIX_VELOCITY_3
from ekf_fusion_ros.roles import GPS_HEADING
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.statistics import RoleStatistics

if TYPE_CHECKING:
    from ekf_fusion_ros.params.session import SessionParams

RELEASE_US = 20_000
"""Time that the way of a fix from here to the filter may take, two of its periods."""

JOINS: dict[str, Callable[..., GnssSample]] = {
    FIX_VELOCITY: with_velocity, GPS_HEADING: with_heading, FIX_VELOCITY_2: with_velocity,
    FIX_VELOCITY_3: with_velocity}


class FixAssembly:
    """A chain of pairings: what leaves one goes into the next, fixes stay in order.

    With no such topic in use a fix passes at once. `waiting` while a fix or a part of one waits
    for its partner.
    """

    def __init__(
        self, fix: str, statistics: Mapping[str, RoleStatistics], roles: Collection[str],
        params: SessionParams, age_limit_us: int,
    ) -> None:
        """Pair role `fix` with its topics in `roles`; `statistics` counts what stays alone.

        No fix waits until it is older than age_limit_us: the filter could not take it any more.
        """
        tolerance_us = round(1e6 * params.pairing_tolerance)
        wait_us = min(round(1e6 * params.pairing_wait), age_limit_us - RELEASE_US)
        self._stages = [role for role in JOINS if role in roles and FIX_OF_PART[role] == fix]
        self._pairings = [FixPairing(statistics[role], tolerance_us, wait_us, JOINS[role])
                          for role in self._stages]
        self.waiting = False

    def push_fix(self, fix: GnssSample) -> Sequence[GnssSample]:
        """Return the fixes that are complete, or will stay as they are."""
        return self._settled(self._through(0, (fix,)))

    def push(self, role: str, part: Part) -> Sequence[GnssSample]:
        """Return the fixes that this part completes."""
        stage = self._stages.index(role)
        return self._settled(self._through(stage + 1, self._pairings[stage].push(part)))

    def advance(self, now_us: int) -> Sequence[GnssSample]:
        """Return the fixes whose wait is over at inertial time `now_us`."""
        fixes: Sequence[GnssSample] = ()
        for stage, pairing in enumerate(self._pairings):
            waited = pairing.advance(now_us) if pairing.waiting else ()
            if waited:
                fixes = [*fixes, *self._through(stage + 1, waited)]
        return self._settled(fixes)

    def flush(self) -> Sequence[GnssSample]:
        """Give up waiting."""
        fixes: list[GnssSample] = []
        for stage, pairing in enumerate(self._pairings):
            fixes += self._through(stage + 1, pairing.flush())
        return self._settled(fixes)

    def _settled(self, fixes: Sequence[GnssSample]) -> Sequence[GnssSample]:
        self.waiting = any(pairing.waiting for pairing in self._pairings)
        return fixes

    def _through(self, stage: int, fixes: Sequence[GnssSample]) -> Sequence[GnssSample]:
        """Take fixes through the pairings from a stage on."""
        for pairing in self._pairings[stage:]:
            fixes = [ready for fix in fixes for ready in pairing.push_fix(fix)]
        return fixes
