"""Height from the range finder: when it may replace another reference, and its fusion."""

from __future__ import annotations

import math

from ekf_fusion_ros.ekf2.aid_sources.range_finder import RangeFinder
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.fusion import fuse_vertical_position
from ekf_fusion_ros.ekf2.state import PD
from ekf_fusion_ros.ekf2.terrain import Terrain

ENTRY_SHARE = 0.7
"""Share of height and speed limits that must hold before range aid starts."""

ENTRY_RATIO = 0.01
"""The same for the test ratio of the terrain."""

MISSING_US = 400_000
NOISE_FLOOR = 0.01


class RangeHeight:
    """Offers range height to the choice of the height reference."""

    def __init__(self, f: Filter, finder: RangeFinder, terrain: Terrain) -> None:
        """Act on a filter with the samples of a finder."""
        self._f = f
        self.finder = finder
        self._terrain = terrain
        self._suitable = False

    def aids(self) -> bool:
        """Judge whether range aid is to be used now; once per filter period."""
        if not self._f.params.range.aid:
            return False
        self._suitable = self._is_suitable()
        return self._suitable

    def _is_suitable(self) -> bool:
        """Low, slow and over known ground, with room to spare on entry."""
        f = self._f
        params = f.params.range
        if not f.flags.in_air or not self.finder.valid or not self._terrain.valid:
            return False
        share, largest_ratio = (1.0, 1.0) if self._suitable else (ENTRY_SHARE, ENTRY_RATIO)
        low = self._terrain.down - float(f.x[PD]) < share * params.aid_max_height
        slow = (not f.flags.aided_horizontally()
                or math.hypot(f.x[4], f.x[5]) <= share * params.aid_max_speed)
        return low and slow and self._terrain_ratio() < largest_ratio

    def _terrain_ratio(self) -> float:
        record = self._f.observations.hagl
        if record.variance[0] <= 0.0:
            return math.inf
        gate = self._f.params.range.aid_gate
        return record.innovation[0] ** 2 / (gate * gate * record.variance[0])

    def ground(self) -> float:
        """Return the down coordinate in m of the ground that makes the present height right."""
        f = self._f
        if not f.flags.in_air:
            return f.params.terrain.ground_clearance
        if self._terrain.valid:
            return self._terrain.down
        return self.finder.height + float(f.x[PD])

    def terrain_down(self) -> float:
        """Return the estimated down coordinate of the ground in m."""
        return self._terrain.down

    def substitute_on_ground(self) -> bool:
        """Replace missing or rejected samples on the ground; True where one was made."""
        f = self._f
        missing = f.late(f.times.hgt, MISSING_US) and not self.finder.fresh
        if not f.flags.rng_hgt or f.flags.in_air or not missing or not self.finder.regular:
            return False
        self.finder.substitute(f.params.terrain.ground_clearance)
        return True

    def fuse(self, ground: float) -> None:
        """Fuse the height above ground, whose down coordinate is given in m."""
        f = self._f
        params, height = f.params.range, self.finder.height
        noise = max(params.noise ** 2 + (params.noise_by_range * height) ** 2, NOISE_FLOOR)
        innovation = float(f.x[PD]) + max(height, f.params.terrain.ground_clearance) - ground
        fuse_vertical_position(f, f.observations.range_height, innovation, noise, params.gate)
