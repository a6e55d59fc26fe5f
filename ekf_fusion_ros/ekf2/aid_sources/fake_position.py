"""Fake position: without horizontal aiding the last known position is held, to keep the tilt."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.fusion import fuse_horizontal_position
from ekf_fusion_ros.ekf2.gnss_checks import GnssChecks
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.state import PN
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.ekf2.state import VN

Array = NDArray[np.float64]

INTERVAL_US = 200_000
REENTRY_US = 400_000
GATE = 3.0
ENFORCED_RATIO = (100.0 / 3.0) ** 2
NOISE_AT_REST = 0.1
NOISE_MOVING = 0.5
VELOCITY_WALK = 1.0
"""Random walk in (m/s)/sqrt(s) of each horizontal velocity of a vehicle that nothing observes."""


class FakePosition:
    """Starts when nothing else constrains horizontal motion, and stops when something does.

    `aloft`: seconds in the air since the position is held, in which the vehicle went elsewhere.
    """

    def __init__(self, f: Filter, resets: Resets) -> None:
        """Act on a filter through its resets."""
        self._f = f
        self._resets = resets
        self._fused_us = 0
        self.aloft = 0.0
        self._speed_square = 0.0
        self._variance_before = 0.0

    def step(self, checks: GnssChecks) -> None:
        """Run once per filter period, after all aid sources."""
        f = self._f
        held, f.holding_position = f.holding_position, not f.flags.aided_horizontally()
        if held and not f.holding_position:
            self._leave()
        if not f.holding_position or not f.late(self._fused_us, INTERVAL_US):
            return
        if f.late(self._fused_us, REENTRY_US):
            self._enter(checks.healthy)
        elif f.flags.in_air:
            self.aloft += (f.t_now - self._fused_us) / SECOND
        self._fused_us = f.t_now
        self._fuse()

    def _enter(self, gnss_healthy: bool) -> None:
        f = self._f
        velocity, variances = f.x[VN:VN + 2], f.cov.p.diagonal()
        self.aloft = 0.0
        self._speed_square = float(velocity @ velocity + variances[VN:VN + 2].max())
        self._variance_before = float(variances[PN:PN + 2].max())
        f.last_known_position = f.x[7:9].copy()
        self._resets.position_to_aiding()
        self._resets.velocity_to_aiding(gnss_healthy)
        if self._fused_us != 0:
            f.events.add(f.t_now, EventKind.NAVIGATION_STOPPED)

    def _leave(self) -> None:
        """Where only velocity aids from now on, the place is as uncertain as it has become."""
        f = self._f
        tells_place = f.flags.gps or f.flags.ev_pos
        if self.aloft and not tells_place and f.params.aiding.doubt_held_position:
            f.cov.set_variances(PN, f.cov.p.diagonal()[PN:PN + 2] + self._moved())
        self.aloft = self._variance_before = 0.0

    def note_position(self) -> None:
        """Let the doubt begin anew from a position that was given; the velocity stays unknown."""
        self._speed_square += VELOCITY_WALK ** 2 * self.aloft
        self.aloft = self._variance_before = 0.0

    def _fuse(self) -> None:
        f = self._f
        if f.flags.in_air and f.flags.tilt_align:
            sigma = max(f.params.aiding.pos_noaid_noise, f.params.gnss.pos_noise)
        else:
            sigma = NOISE_AT_REST if f.flags.vehicle_at_rest else NOISE_MOVING
        innovation = (f.x[7:9] - f.last_known_position).tolist()
        before = f.rejections.hor_pos
        if not fuse_horizontal_position(f, f.observations.fake_pos, innovation,
                                        (sigma ** 2, sigma ** 2), GATE,
                                        enforce_up_to=ENFORCED_RATIO):
            f.rejections.hor_pos = before

    def widen(self, pose_cov: Array, velocity_cov: Array) -> None:
        """Add to the covariances (6, 6) and (3, 3) of the output what the filter does not see.

        It stays where it was. The vehicle had a speed s, which it may keep in any direction, and
        its velocity has since walked by w per root of a second: after t seconds each horizontal
        velocity has the variance s^2 + w^2 t, and the position, which is its integral, s^2 t^2 +
        w^2 t^3 / 3 beside what it had before. After a landing the velocity is known again.
        """
        pose_cov.ravel()[[0, 7]] += self._moved()
        if self._f.flags.in_air:
            velocity_cov.ravel()[[0, 4]] += self._speed_square + VELOCITY_WALK ** 2 * self.aloft

    def _moved(self) -> float:
        """Return the variance in m^2 of where the vehicle has gone since, along each axis."""
        t = self.aloft
        return self._variance_before + (
            self._speed_square + VELOCITY_WALK ** 2 * t / 3.0) * t ** 2
