"""How far the track passes by fixes, those that were used or those that were withheld."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Sequence
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.fused_output import FusedOutput
from ekf_fusion_ros.geo.projection import Projection
from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.samples import GnssSample

Array = NDArray[np.float64]

MEMORY_US = 3_000_000
"""How far back a fix may count; more than any delay and hold."""

LIMIT_SIGMAS, LIMIT_MARGIN = 3.0, 2.0


class FixDistance:
    """Horizontal distance in m from each fix to the causal track, at the time of the fix.

    The track is that before the fix was known: what it corrects comes later. A fix counts at its
    stamp less the delay of the receiver. Beyond three of its sigmas plus 2 m it is over the limit.
    """

    def __init__(self, params: Params) -> None:
        """Take delay and projection from the parameters."""
        self._delay_us = round(1000 * params.ekf2.gnss.delay_ms)
        self._kind = params.ekf2.earth.projection
        self._projection: tuple[GeoPoint, Projection] | None = None
        self._recent = np.zeros((0, 3))
        self._waiting: list[GnssSample] = []
        self._count = 0
        self._over = 0
        self._sum = 0.0
        self._largest = 0.0

    def note(self, rows: Sequence[FusedOutput], fixes: Iterable[GnssSample]) -> None:
        """Take the next rows of the track and fixes, which wait until the track reaches them."""
        self._waiting += fixes
        if not rows:
            return
        newest = [(row.time_us, *row.nav.position[0:2].tolist()) for row in rows]
        track = np.vstack([self._recent, newest])
        waiting, self._waiting = self._waiting, []
        for fix in waiting:
            at_us = fix.time_us - self._delay_us
            if at_us > track[-1, 0]:
                self._waiting.append(fix)
            elif at_us >= track[0, 0]:
                self._measure(fix, at_us, rows[-1].nav.origin, track)
        self._recent = track[track[:, 0] > track[-1, 0] - MEMORY_US]

    def as_dict(self) -> dict[str, Any] | None:
        """Return number, RMS, largest and number over the limit; None without any fix."""
        if not self._count:
            return None
        return {'count': self._count, 'rms': math.sqrt(self._sum / self._count),
                'largest': self._largest, 'over_limit': self._over}

    def _measure(
        self, fix: GnssSample, at_us: int, origin: GeoPoint | None, track: Array,
    ) -> None:
        if origin is None:
            return
        north, east = self._project(origin, fix)
        distance = math.hypot(float(np.interp(at_us, track[:, 0], track[:, 1])) - north,
                              float(np.interp(at_us, track[:, 0], track[:, 2])) - east)
        self._count += 1
        self._sum += distance * distance
        self._largest = max(self._largest, distance)
        self._over += distance > LIMIT_SIGMAS * fix.eph + LIMIT_MARGIN

    def _project(self, origin: GeoPoint, fix: GnssSample) -> tuple[float, float]:
        if self._projection is None or self._projection[0] != origin:
            self._projection = origin, make_projection(
                self._kind, origin.lat, origin.lon, origin.alt)
        north, east = self._projection[1].project(fix.lat, fix.lon)
        return north, east
