"""Yaw from the EKF-GSF bank: alignment without a compass, and rescue after a bad one."""

from __future__ import annotations

from collections.abc import Callable
import math

from ekf_fusion_ros.ekf2.covariance import rotation_vector_variances
from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.ekf2.yaw_estimator import YawEstimator
from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.mathlib.rotation import yaw_of

YAW_SIGMA_MAX = 0.262
RETRY_US = 5 * SECOND
TAKE_OFF_US = 30 * SECOND
REJECTED_US = 1 * SECOND
FIX_GAP_US = 1 * SECOND
MAX_RESETS = 3
YAW_ERROR = math.radians(25.0)
COURSE_ERROR_COS2 = math.cos(YAW_ERROR) ** 2
CONTRADICTION_SIGMA = 3.0
MIN_SPEED_SQUARED = 0.16
"""Squared speed in (m/s)^2 below which a course says nothing about yaw."""


class YawRecovery:
    """Decides when the yaw of the bank replaces that of the filter."""

    def __init__(self, f: Filter, resets: Resets, bank: YawEstimator) -> None:
        """Act on a filter through its resets."""
        self._f = f
        self._resets = resets
        self._bank = bank
        self._requested = False
        self._last_reset_us = 0
        self._count = 0

    def request(self) -> None:
        """Ask for alignment from the bank as soon as it is certain."""
        self._requested = True
        self._last_reset_us = 0

    def align_without_gnss(self) -> None:
        """Serve a pending request while GNSS waits for a yaw; its start then resets the rest."""
        f = self._f
        if f.flags.yaw_align:
            self._requested = False
        if not self._requested or not f.late(self._last_reset_us, RETRY_US):
            return
        if self._turn_to_bank(self._resets.yaw):
            self._last_reset_us = f.t_now
            self._requested = False

    def step(self, timed_out: bool, previous_fix_us: int, gnss_healthy: bool) -> bool:
        """Reset yaw when GNSS velocity says it is wrong; True rules out other resets."""
        f = self._f
        if not self._yaw_failed(timed_out):
            return False
        may_retry = self._count < MAX_RESETS and f.late(self._last_reset_us, RETRY_US)
        if not may_retry or f.late(previous_fix_us, FIX_GAP_US):
            return False
        if self._turn_to_bank(self._resets.false_yaw):
            self._resets.velocity_to_aiding(gnss_healthy)
            self._resets.position_to_aiding()
            self._last_reset_us = f.t_now
            self._count += 1
            times = f.times
            times.hor_pos = times.hor_vel = times.flow = f.t_now
        return True

    def _yaw_failed(self, timed_out: bool) -> bool:
        f = self._f
        times = f.times
        flown = times.hor_vel > f.last_on_ground_us
        after_take_off = not f.late(f.last_on_ground_us, TAKE_OFF_US)
        bad_take_off = (f.flags.in_air and after_take_off
                        and f.late(times.hor_vel, REJECTED_US) and flown)
        bad_flight = (f.flags.in_air and timed_out and flown
                      and times.hor_pos > f.last_on_ground_us)
        if not (bad_take_off or bad_flight) or times.hor_vel == 0:
            return False
        return self._courses_differ()

    def contradicted(self) -> bool:
        """True where the bank is certain of a yaw that is not that of the filter."""
        f = self._f
        if not (f.params.gnss.thorough_yaw_recovery and self._bank_is_certain()):
            return False
        difference = abs(wrap_pi(self._bank.yaw - yaw_of(f.rot)))
        own_variance = rotation_vector_variances(f.x[0:4], f.cov.p)[2]
        sigma = math.sqrt(self._bank.variance + float(own_variance))
        return difference > max(YAW_ERROR, CONTRADICTION_SIGMA * sigma)

    def _courses_differ(self) -> bool:
        """Compare the course of the last velocity observation with that of the state."""
        f = self._f
        observed, noise = f.last_velocity, f.last_velocity_variance
        speed2 = observed[0] ** 2 + observed[1] ** 2
        own2 = float(f.x[4] ** 2 + f.x[5] ** 2)
        own_noise = float(f.cov.p[4, 4] + f.cov.p[5, 5])
        both_move = (speed2 > max(16.0 * (noise[0] + noise[1]), MIN_SPEED_SQUARED)
                     and own2 > max(16.0 * own_noise, MIN_SPEED_SQUARED))
        if not both_move:
            return False
        dot = float(observed[0] * f.x[4] + observed[1] * f.x[5])
        return dot < 0.0 or dot * dot < COURSE_ERROR_COS2 * speed2 * own2

    def _bank_is_certain(self) -> bool:
        return self._bank.running and self._bank.variance < YAW_SIGMA_MAX ** 2

    def _turn_to_bank(self, turn: Callable[[float, float], None]) -> bool:
        """Take over the yaw of the bank; False while it is not certain enough."""
        f = self._f
        if not self._bank_is_certain():
            return False
        turn(self._bank.yaw, self._bank.variance)
        f.flags.yaw_align = True
        if f.params.mag.type == 'none':
            f.events.add(f.t_now, EventKind.YAW_ALIGNED_IMU_GPS)
        else:
            f.flags.mag_fault = True
            f.events.add(f.t_now, EventKind.EMERGENCY_YAW_RESET)
        return True
