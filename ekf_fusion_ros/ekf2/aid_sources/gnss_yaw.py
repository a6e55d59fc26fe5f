"""Yaw from a dual-antenna receiver: starts with a reset and replaces the compass."""

from __future__ import annotations

import math

import numpy as np

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.filter import GnssFix
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.scalar import fuse_scalar
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.kernels.antenna_yaw import antenna_gradient
from ekf_fusion_ros.kernels.innovation import project
from ekf_fusion_ros.kernels.update import test_ratio
from ekf_fusion_ros.mathlib.angles import wrap_pi

INTERMITTENT_US = SECOND
UPRIGHT = math.cos(math.radians(30.0))
NOISE_MIN = 1e-2


class GnssYaw:
    """Starts, fuses, resets once, and gives up when that did not help."""

    def __init__(self, f: Filter, resets: Resets) -> None:
        """Act on a filter through its resets."""
        self._f = f
        self._resets = resets
        self._enabled = f.params.gnss.yaw
        self._last_data_us = 0
        self._fused_us = 0
        self._resets_left = 0
        self._faulty = False
        self._h, self._hp = np.zeros(24), np.zeros(24)

    def step(self, fix: GnssFix, passing: bool, failing: bool, intermittent: bool) -> None:
        """Run once per fix.

        passing, failing: verdict of the receiver checks; intermittent: fixes come irregularly.
        """
        f = self._f
        was_on = f.flags.gps_yaw
        if not self._enabled or self._faulty:
            f.flags.gps_yaw = False
            return
        if math.isfinite(fix.yaw):
            regular = f.recent(self._last_data_us, INTERMITTENT_US) and not intermittent
            self._last_data_us = f.t_now
            may_start = passing and not failing and f.flags.tilt_align and regular
            if f.flags.gps_yaw:
                self._continue(fix, failing, may_start)
            elif may_start:
                self._start(fix)
        elif f.flags.gps_yaw and f.late(self._last_data_us, self._timeout_us):
            f.flags.gps_yaw = False
        if was_on and not f.flags.gps_yaw and not f.flags.in_air:
            # before take-off a heading that nothing measures any more is not good enough
            f.flags.yaw_align = False

    @property
    def _timeout_us(self) -> int:
        return round(self._f.params.aiding.reset_timeout * SECOND)

    @property
    def _sigma(self) -> float:
        return max(self._f.params.mag.heading_noise, NOISE_MIN)

    def _continue(self, fix: GnssFix, failing: bool, may_start: bool) -> None:
        f = self._f
        if failing:
            f.flags.gps_yaw = False
            return
        self._fuse(fix)
        if not f.late(self._fused_us, self._timeout_us):
            return
        if self._resets_left > 0:
            self._resets_left -= 1
            self._reset(fix)
            return
        self._faulty = may_start
        f.flags.gps_yaw = False

    def _start(self, fix: GnssFix) -> None:
        f, flags = self._f, self._f.flags
        if not self._reset(fix):
            return
        flags.yaw_align = True
        self._resets_left = 1
        flags.gps_yaw = True
        flags.mag_dec = flags.ev_yaw = flags.mag_hdg = False
        if flags.mag_3d:
            flags.mag_3d = False
            f.cov.activate_mag(False)

    def _axis(self, offset: float) -> tuple[float, float, float]:
        """Return the axis of the antennas in the earth frame at the cached attitude."""
        c, s = math.cos(offset), math.sin(offset)
        north, east, down = (self._f.rot[:, 0] * c + self._f.rot[:, 1] * s).tolist()
        return north, east, down

    def _reset(self, fix: GnssFix) -> bool:
        """Turn to the yaw of a fix; False where the antennas stand one above the other."""
        if abs(self._axis(fix.yaw_offset)[2]) > UPRIGHT:
            return False
        self._resets.yaw(fix.yaw, self._sigma ** 2)
        self._fused_us = self._f.t_now
        return True

    def _fuse(self, fix: GnssFix) -> None:
        f = self._f
        north, east, down = self._axis(fix.yaw_offset)
        if abs(down) > UPRIGHT:
            return
        # the receiver has taken the angle of the antennas off; what is observed is their axis
        innovation = wrap_pi(math.atan2(east, north) - wrap_pi(fix.yaw + fix.yaw_offset))
        if not antenna_gradient(f.x[0:4], fix.yaw_offset, self._h):
            return
        noise = self._sigma ** 2
        variance = project(f.cov.p, self._h, self._hp) + noise
        f.faults.heading = variance < noise
        if f.faults.heading:
            f.covariance_lost = True
            return
        innovation, rejected = self._gate(innovation, variance)
        if rejected:
            return
        healthy = fuse_scalar(f, self._hp, variance, innovation)
        f.faults.heading = not healthy
        if healthy:
            self._fused_us = f.t_now

    def _gate(self, innovation: float, variance: float) -> tuple[float, bool]:
        """Return the innovation, clipped where it fails on the ground, and whether it is refused.

        On the ground interference or a gyro bias is likelier than a wrong yaw.
        """
        f = self._f
        gate = max(f.params.mag.heading_gate, 1.0)
        record = f.observations.yaw
        ratio = test_ratio(innovation, variance, gate)
        f.observations.mag.test_ratio = 0.0
        f.rejections.yaw = ratio > 1.0
        refused = f.rejections.yaw and f.flags.in_air
        if f.rejections.yaw and not refused:
            limit = gate * math.sqrt(variance)
            innovation = min(max(innovation, -limit), limit)
        record.note(f.t_now, (innovation,), (variance,), ratio, not refused)
        return innovation, refused
