"""Height of the ground under the vehicle: one state of its own."""

from __future__ import annotations

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.state import PD
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.ekf2.state import VE
from ekf_fusion_ros.ekf2.state import VN

VARIANCE_MAX = 1e4
VALID_US = 5 * SECOND


class Terrain:
    """Down position of the ground. On the ground it is known; in the air its variance grows."""

    def __init__(self, f: Filter) -> None:
        """Act on a filter."""
        self._f = f
        self.down = 0.0
        self.variance = 0.0
        self._last_on_ground_down = 0.0
        self._initialised = False

    def initialise(self) -> None:
        """Take the ground to be just below the vehicle."""
        f = self._f
        clearance = f.params.terrain.ground_clearance
        self.down = float(f.x[PD]) + clearance
        self.variance = clearance ** 2
        self._initialised = True
        f.times.hagl = f.t_now
        f.times.flow_terrain = f.t_now

    def move(self, shift: float) -> None:
        """Shift down in m: the frame has moved, not the ground."""
        self.down += shift
        self._last_on_ground_down += shift

    def step(self) -> None:
        """Run once per filter period, after all fusion."""
        f = self._f
        down = f.x.item(PD)
        if not f.flags.in_air:
            self._last_on_ground_down = down
            clearance = f.params.terrain.ground_clearance
            self.down = self._last_on_ground_down + clearance
            self.variance = clearance ** 2
            f.times.hagl = f.t_now
        else:
            dt = f.imu.increments.item(7)
            params = f.params.terrain
            speed_squared = f.x.item(VN) ** 2 + f.x.item(VE) ** 2
            growth = ((dt * params.process_noise) ** 2
                      + (dt * params.gradient) ** 2 * speed_squared)
            self.variance = min(max(self.variance + growth, 0.0), VARIANCE_MAX)
        highest = down + f.params.terrain.ground_clearance
        self.down = max(self.down, highest)

    @property
    def valid(self) -> bool:
        """True while ground contact or a sensor has fixed the height recently."""
        f = self._f
        return self._initialised and (
            f.recent(f.times.hagl, VALID_US) or f.recent(f.times.flow_terrain, VALID_US))

    def ground_down(self) -> float:
        """Return the best down coordinate of the ground in m."""
        return self.down if self.valid else self._last_on_ground_down
