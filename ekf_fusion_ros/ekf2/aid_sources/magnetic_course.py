"""Alignment of a fixed wing to the course of its fixes, which checks and replaces the compass."""

from __future__ import annotations

from collections.abc import Callable
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.aid_sources.magnetic_fusion import start_field_from
from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.filter import GnssFix
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.state import BODY_FIELD
from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import yaw_321

Array = NDArray[np.float64]

SPEED_MIN = 5.0
ACCURACY_SHARE = 0.15
"""Largest speed accuracy over speed at which a course can be used."""

COURSE_ERROR_MAX = 0.5
BAD_YAW_MAX = 2
"""Number of bad headings in one flight at which the compass is given up."""


class CourseAlignment:
    """Judges the heading by the course of the fixes."""

    def __init__(self, f: Filter, resets: Resets, contradicted: Callable[[], bool]) -> None:
        """Act on a filter through its resets.

        contradicted: whether the yaw is about to be replaced by one that is better known.
        """
        self._f = f
        self._resets = resets
        self._contradicted = contradicted
        self._bad_yaws = 0
        self.must_reset = False

    def land(self) -> None:
        """Forget the bad headings of the flight."""
        self._bad_yaws = 0

    def usable_fix(self) -> GnssFix | None:
        """Return the delayed fix where its course is good enough."""
        fix = self._f.fix
        if fix is None or not fix.has_velocity:
            return None
        speed = math.hypot(fix.velocity[0], fix.velocity[1])
        good = speed > SPEED_MIN and fix.sacc < ACCURACY_SHARE * speed
        return fix if good else None

    def align(self, fix: GnssFix, field: Array) -> bool:
        """Turn to the course where the heading is bad, and start the earth field anew.

        field (3,): the delayed measurement in body axes. `must_reset` then tells whether velocity
        and position have suffered. False where a bad heading is left to who knows better.
        """
        f = self._f
        error = wrap_pi(math.atan2(fix.velocity[1], fix.velocity[0])
                        - math.atan2(f.x[5], f.x[4]))
        velocity_refused = f.flags.gps and f.observations.gps_hor_vel.test_ratio > 1.0
        bad = abs(error) > COURSE_ERROR_MAX and velocity_refused
        if bad and self._contradicted():
            return False
        self._bad_yaws += bad
        if bad or not f.flags.yaw_align:
            self._turn(fix, error)
            self.must_reset = bad
            f.x[BODY_FIELD] = 0.0
        start_field_from(f, field)
        f.cov.reset_field(f.params.mag.noise ** 2)
        return True

    def _turn(self, fix: GnssFix, error: float) -> None:
        f = self._f
        flags = f.flags
        f.events.add(f.t_now, EventKind.BAD_YAW_COURSE_USED)
        again = flags.mag_aligned_in_flight and self._bad_yaws >= BAD_YAW_MAX
        if again and not flags.mag_fault:
            flags.mag_fault = True
            f.events.add(f.t_now, EventKind.MAG_STOPPED)
        north, east = float(fix.velocity[0]), float(fix.velocity[1])
        speed = math.hypot(north, east)
        if not flags.mag_aligned_in_flight:
            # after a launch straight ahead the difference of the courses is the error of yaw
            yaw = wrap_pi(yaw_321(matrix_from_quat(f.x[0:4])) + error)
            flags.mag_aligned_in_flight = True
        elif flags.wind:
            yaw = math.atan2(east - f.x[23], north - f.x[22])
        else:
            yaw = math.atan2(east, north)
        spread = math.sqrt(fix.sacc ** 2 + f.cov.p[4, 4] + f.cov.p[5, 5])
        self._resets.false_yaw(yaw, math.asin(min(spread / speed, 1.0)) ** 2)
