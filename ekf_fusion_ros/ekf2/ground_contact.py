"""On the ground or in the air: told by a landed sample, inferred from motion until one comes."""

from __future__ import annotations

import math

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.samples import LandedSample

FLIGHT_SPEED = 1.0
FLIGHT_HEIGHT = 1.0
SIGNIFICANT = 3.0
"""A speed counts from this many of its sigmas on."""


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

    def tell(self, sample: LandedSample) -> None:
        """Take a landed sample; it acts at once."""
        f = self._f
        self._told = True
        f.flags.fixed_wing = sample.fixed_wing
        f.flags.fuse_beta = sample.fuse_beta and not sample.landed
        self._set(not sample.landed)

    def step(self, quiet: bool) -> None:
        """Infer from motion; once per filter period. quiet: no vibration or rotation lately."""
        f = self._f
        if self._told or not f.params.aiding.infer_in_air or not f.flags.tilt_align:
            return
        if quiet:
            self._rest_down = float(f.x[9])
            self._set(False)
        elif f.flags.in_air or self._moves():
            self._set(True)

    def _moves(self) -> bool:
        f = self._f
        if abs(float(f.x[9]) - self._rest_down) > FLIGHT_HEIGHT:
            return True
        fix = f.fix
        if fix is None or not fix.has_velocity:
            return False
        speed = math.hypot(float(fix.velocity[0]), float(fix.velocity[1]))
        return speed > max(FLIGHT_SPEED, SIGNIFICANT * fix.sacc)

    def _set(self, in_air: bool) -> None:
        f = self._f
        f.flags.in_air = in_air
        if in_air:
            f.last_in_air_us = f.t_now
        else:
            f.last_on_ground_us = f.t_now
