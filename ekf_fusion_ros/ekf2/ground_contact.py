"""On the ground or in the air: told by a landed sample, inferred from motion until one comes.

Of a rover motion alone decides.
"""

from __future__ import annotations

import math

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.samples import SIGNIFICANT
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.samples import travels

FLIGHT_HEIGHT = 1.0
ROLLING_SPEED = 0.2


class GroundContact:
    """Sets the in-air flag and remembers when it last held or did not.

    A ground vehicle that drives counts as in the air: what the flag frees (learning of all biases,
    the yaw bank) needs motion, not height.
    """

    def __init__(self, f: Filter) -> None:
        """Act on a filter."""
        self._f = f
        self._told = False
        self._rest_down = 0.0
        vehicle = f.params.aiding.vehicle
        self._is_rover = vehicle == 'rover'
        self._infers = f.params.aiding.infer_in_air
        self._on_wings = f.flags.fixed_wing = vehicle == 'fixed_wing'
        self._zero_sideslip = self._on_wings and f.params.air_data.use_sideslip

    def tell(self, sample: LandedSample) -> None:
        """Take a landed sample; it acts at once."""
        if self._is_rover:
            return
        self._told = True
        self._f.flags.fixed_wing = sample.fixed_wing or self._on_wings
        wanted = sample.fuse_beta or self._on_wings
        self._zero_sideslip = wanted and self._f.params.air_data.use_sideslip
        self._set(not sample.landed)

    def step(self, quiet: bool) -> None:
        """Infer from motion; once per filter period. quiet: no vibration or rotation lately."""
        f = self._f
        if self._told or not f.flags.tilt_align:
            return
        if not f.last_on_ground_us:
            # what is known of a flight begins here, be it in the air
            f.last_on_ground_us = f.t_now
        if self._is_rover:
            self._set(self._rolls() or (not quiet and (f.flags.in_air or self._travels())))
        elif not self._infers:
            return
        elif quiet:
            self._rest_down = float(f.x[9])
            self._set(False)
        else:
            self._set(f.flags.in_air or self._climbs() or self._travels())

    def moves_evenly(self) -> bool:
        """True where the estimate moves, whatever the inertial sensors say of rest."""
        return self._infers and self._f.flags.tilt_align and self._rolls()

    def _climbs(self) -> bool:
        return abs(float(self._f.x[9]) - self._rest_down) > FLIGHT_HEIGHT

    def _rolls(self) -> bool:
        """Return whether the estimate moves; at an even speed no sensor of inertia tells."""
        f = self._f
        sigma = math.sqrt(f.cov.p[4, 4] + f.cov.p[5, 5])
        return math.hypot(f.x[4], f.x[5]) > max(ROLLING_SPEED, SIGNIFICANT * sigma)

    def _travels(self) -> bool:
        """Return whether the latest fix moves."""
        fix = self._f.fix
        return fix is not None and fix.has_velocity and travels(fix.velocity, fix.sacc)

    def _set(self, in_air: bool) -> None:
        f = self._f
        f.flags.in_air = in_air
        f.flags.fuse_beta = in_air and self._zero_sideslip
        if in_air:
            f.last_in_air_us = f.t_now
        else:
            f.last_on_ground_us = f.t_now
