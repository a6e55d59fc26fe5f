"""Height of the ground under the vehicle: one state of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ekf_fusion_ros.ekf2.aid_sources.range_finder import RangeFinder
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.scalar import passes
from ekf_fusion_ros.ekf2.state import PD
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.ekf2.state import VE
from ekf_fusion_ros.ekf2.state import VN
from ekf_fusion_ros.kernels.update import test_ratio

if TYPE_CHECKING:
    from ekf_fusion_ros.ekf2.aid_sources.optical_flow import OpticalFlow

VARIANCE_MAX = 1e4
VALID_US = 5 * SECOND
RESET_US = 10 * SECOND


class Terrain:
    """Down position of the ground. On the ground it is known; in the air its variance grows."""

    def __init__(self, f: Filter) -> None:
        """Act on a filter."""
        self._f = f
        self.down = 0.0
        self.variance = 0.0
        self._last_on_ground_down = 0.0
        self._initialised = False
        terrain = f.params.terrain
        self._clearance = terrain.ground_clearance
        self._drift_var = terrain.process_noise ** 2
        self._slope_var = terrain.gradient ** 2

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

    def step(self, finder: RangeFinder, flow: OpticalFlow) -> None:
        """Predict and fuse; once per filter period, after all other fusion."""
        self._predict()
        if finder.fresh:
            self.fuse_range(finder)
        if flow.for_terrain:
            flow.aid_terrain()
        self.keep_below()

    def _predict(self) -> None:
        """Hold the ground below a vehicle that stands on it, else let it become uncertain."""
        f = self._f
        if not f.flags.in_air:
            self._last_on_ground_down = f.x.item(PD)
            self.down = self._last_on_ground_down + self._clearance
            self.variance = self._clearance ** 2
            f.times.hagl = f.t_now
            return
        north, east, dt = f.x.item(VN), f.x.item(VE), f.imu.increments.item(7)
        growth = dt * dt * (self._drift_var + self._slope_var * (north * north + east * east))
        self.variance = min(self.variance + growth, VARIANCE_MAX)

    def keep_below(self) -> None:
        """Keep the ground below the vehicle."""
        highest = self._f.x.item(PD) + self._clearance
        if self.down < highest:
            self.down = highest

    def fuse_range(self, finder: RangeFinder) -> None:
        """Fuse a fresh height above ground in flight; reset to it when refused for too long."""
        f = self._f
        if not finder.fresh or not f.flags.in_air or not f.params.terrain.use_range:
            return
        params = f.params.range
        innovation = self.down - float(f.x[PD]) - finder.height
        noise = params.noise ** 2 + (params.noise_by_range * finder.distance) ** 2
        variance = self.variance + noise
        if passes(f, f.observations.hagl, innovation, variance, params.gate):
            gain = self.variance / variance
            self.down -= gain * innovation
            self.variance *= 1.0 - gain
            f.times.hagl = f.t_now
            self._note_rejection(False)
        elif f.late(f.times.hagl, RESET_US):
            self.down = float(f.x[PD]) + finder.height
            self.variance = noise
        else:
            self._note_rejection(True)

    def _note_rejection(self, rejected: bool) -> None:
        self._f.rejections.hagl = rejected
        self._f.rejections.flow_judged_after_hagl = False

    def fuse_flow(
        self, rate: tuple[float, float], velocity: tuple[float, float], cos_tilt: float,
        noise: float, gate: float,
    ) -> tuple[tuple[float, float], tuple[float, float]]:
        """Fuse the flow rate in rad/s about x and y at a body velocity along x and y in m/s.

        cos_tilt: cosine of the tilt of the camera axis; noise in (rad/s)^2. Returns innovations
        and their variances. The predicted rate is v cos_tilt / h with the height h above ground
        before the first axis.
        """
        f = self._f
        self.keep_below()
        per_height = 1.0 / (self.down - float(f.x[PD]))
        innovations, variances = [], []
        for measured, speed in ((rate[0], velocity[1]), (rate[1], -velocity[0])):
            predicted = speed * cos_tilt * per_height
            h = predicted * per_height
            variance = h * h * self.variance + noise
            innovation = predicted - measured
            if test_ratio(innovation, variance, gate) <= 1.0:
                gain = self.variance * h / variance
                self.down += gain * innovation
                self.variance = max(self.variance * (1.0 - gain * h), 0.0)
                f.times.flow_terrain = f.t_now
            innovations.append(innovation)
            variances.append(variance)
        return (innovations[0], innovations[1]), (variances[0], variances[1])

    @property
    def valid(self) -> bool:
        """True while ground contact or a sensor has fixed the height recently."""
        f = self._f
        return self._initialised and (
            f.recent(f.times.hagl, VALID_US) or f.recent(f.times.flow_terrain, VALID_US))

    def ground_down(self) -> float:
        """Return the best down coordinate of the ground in m."""
        return self.down if self.valid else self._last_on_ground_down
