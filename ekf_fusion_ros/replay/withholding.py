"""Windows of time in which messages of a role are kept from the filter, for the score."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Sequence
from typing import Any

from ekf_fusion_ros.roles import FIX_OF_PART
from ekf_fusion_ros.samples import GnssSample

Window = tuple[float, float]


class Withholding:
    """Tells whether a stamp of a role lies in a window [S, E) of seconds from the start.

    What it keeps of the fixes is for the score of the prediction.
    """

    def __init__(self, windows: Mapping[str, Sequence[Window]], start_us: int) -> None:
        self._windows = {
            role: [(start_us + round(1e6 * first), start_us + round(1e6 * end))
                   for first, end in pairs]
            for role, pairs in windows.items()}
        for role, fix in FIX_OF_PART.items():
            if fix in self._windows:
                self._windows[role] = self._windows.get(role, []) + self._windows[fix]
        self.roles = frozenset(self._windows)
        self._fixes: list[GnssSample] = []

    def holds(self, role: str, time_us: int) -> bool:
        """True where a message of this stamp is to be kept back."""
        return any(first <= time_us < end for first, end in self._windows.get(role, ()))

    def keep(self, sample: Any) -> None:
        """Keep a withheld fix; the track is held against it."""
        if isinstance(sample, GnssSample):
            self._fixes.append(sample)

    def take_fixes(self) -> list[GnssSample]:
        """Return the fixes kept since the last call."""
        fixes, self._fixes = self._fixes, []
        return fixes
