"""Fake position: without horizontal aiding the last known position is held, to keep the tilt."""

from __future__ import annotations

from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.fusion import fuse_horizontal_position
from ekf_fusion_ros.ekf2.gnss_checks import GnssChecks
from ekf_fusion_ros.ekf2.resets import Resets

INTERVAL_US = 200_000
REENTRY_US = 400_000
GATE = 3.0
ENFORCED_RATIO = (100.0 / 3.0) ** 2
NOISE_AT_REST = 0.1
NOISE_MOVING = 0.5


class FakePosition:
    """Starts when nothing else constrains horizontal motion, and stops when something does."""

    def __init__(self, f: Filter, resets: Resets) -> None:
        """Act on a filter through its resets."""
        self._f = f
        self._resets = resets
        self._fused_us = 0

    def step(self, checks: GnssChecks) -> None:
        """Run once per filter period, after all aid sources."""
        f = self._f
        f.holding_position = not f.flags.aided_horizontally()
        if not f.holding_position or not f.late(self._fused_us, INTERVAL_US):
            return
        if f.late(self._fused_us, REENTRY_US):
            self._enter(checks.healthy)
        self._fused_us = f.t_now
        self._fuse()

    def _enter(self, gnss_healthy: bool) -> None:
        f = self._f
        f.last_known_position = f.x[7:9].copy()
        self._resets.position_to_aiding()
        self._resets.velocity_to_aiding(gnss_healthy)
        if self._fused_us != 0:
            f.events.add(f.t_now, EventKind.NAVIGATION_STOPPED)

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
