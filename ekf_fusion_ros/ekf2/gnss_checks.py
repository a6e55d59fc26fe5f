"""Receiver quality checks that gate the origin and the start of GNSS aiding."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.geo.projection import Projection
from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.samples import GnssSample

Array = NDArray[np.float64]

FILTER_TIME = 10.0
"""Time constant in s of the drift filters."""

INPUT_LIMIT = 10.0
"""Drift inputs are clamped to this many times their limit."""

CHECK_NAMES = ('fix', 'nsats', 'pdop', 'hacc', 'vacc', 'sacc', 'hdrift', 'vdrift', 'hspeed',
               'vspeed')


@dataclass(slots=True)
class CheckResult:
    """One check: its value, its limit, and whether it failed; None = the fix does not tell."""

    failed: bool | None = None
    value: float = math.nan
    limit: float = math.nan


class GnssChecks:
    """Runs at the arrival of every fix; a check that the fix cannot feed is skipped."""

    def __init__(self, f: Filter) -> None:
        """Act on a filter."""
        self._f = f
        self.results = {name: CheckResult() for name in CHECK_NAMES}
        self.error_norm = 1.0
        self.healthy_at_arrival = False
        self.last_fail_us = 0
        self.last_pass_us = 0
        self._previous: GnssSample | None = None
        self._previous_us = 0
        self._drift = np.zeros(3)
        self._speed = np.zeros(2)
        self._climb = 0.0
        self._ran = False

    @property
    def healthy(self) -> bool:
        """True when no selected check has failed for the health time."""
        wait = round(self._f.params.gnss.checks.health_time * SECOND)
        return self._ran and self._f.late(self.last_fail_us, wait)

    @property
    def passing(self) -> bool:
        """True when no selected check has failed lately."""
        wait = round(self._f.params.gnss.checks.start_time * SECOND)
        return self._f.late(self.last_fail_us, wait)

    @property
    def failing(self) -> bool:
        """True when the selected checks have not passed lately."""
        wait = round(self._f.params.gnss.checks.start_time * SECOND)
        return self._f.late(self.last_pass_us, wait)

    def blocking(self) -> list[str]:
        """Return the names of the selected checks that have failed; the fix test is always on."""
        selected = self._f.params.gnss.checks
        return [name for name, result in self.results.items()
                if result.failed and (name == 'fix' or getattr(selected, name))]

    def run(self, fix: GnssSample) -> None:
        """Judge a fix."""
        limits = self._f.params.gnss.checks
        self._accuracy(fix)
        self._judge('fix', float(fix.fix_type), 3.0, fix.fix_type < 3)
        self._judge_below('nsats', math.nan if fix.nsats is None else float(fix.nsats),
                          float(limits.req_nsats))
        self._judge_above('pdop', math.nan if fix.pdop is None else fix.pdop, limits.req_pdop)
        self._judge_above('hacc', fix.eph, limits.req_hacc)
        self._judge_above('vacc', fix.epv, limits.req_vacc)
        self._judge_above('sacc', fix.sacc, limits.req_sacc)
        self._motion(fix)
        self._stamp()
        self.healthy_at_arrival = self.healthy

    def _accuracy(self, fix: GnssSample) -> None:
        limits = self._f.params.gnss.checks
        shares = (fix.eph / limits.req_hacc, fix.epv / limits.req_vacc,
                  fix.sacc / limits.req_sacc)
        self.error_norm = max((s for s in shares if math.isfinite(s)), default=1.0)

    def _judge(self, name: str, value: float, limit: float, failed: bool) -> None:
        result = self.results[name]
        result.value, result.limit = value, limit
        result.failed = None if math.isnan(value) else failed

    def _judge_above(self, name: str, value: float, limit: float) -> None:
        self._judge(name, value, limit, value > limit)

    def _judge_below(self, name: str, value: float, limit: float) -> None:
        self._judge(name, value, limit, value < limit)

    def _motion(self, fix: GnssSample) -> None:
        """Drift checks; only a vehicle at rest on the ground can be seen to drift."""
        f = self._f
        elapsed = (f.t_now - self._previous_us) * 1e-6
        dt = min(max(elapsed, 1e-3), FILTER_TIME)
        share = dt / FILTER_TIME
        if f.flags.in_air:
            for name in ('hdrift', 'vdrift', 'hspeed'):
                self.results[name].failed = False
            self._forget_drift()
        elif f.flags.vehicle_at_rest:
            self._drift_at_rest(fix, dt, share)
        else:
            self._forget_drift()
        if fix.has_velocity:
            limit = f.params.gnss.checks.req_vdrift
            difference = float(fix.velocity[2] - f.x[6])
            clamped = min(max(difference, -INPUT_LIMIT * limit), INPUT_LIMIT * limit)
            self._climb += share * (clamped - self._climb)
            self._judge_above('vspeed', abs(self._climb), limit)
        self._previous = fix
        self._previous_us = f.t_now

    def _drift_at_rest(self, fix: GnssSample, dt: float, share: float) -> None:
        limits = self._f.params.gnss.checks
        bound = INPUT_LIMIT * np.array((limits.req_hdrift, limits.req_hdrift, limits.req_vdrift))
        displacement = np.zeros(3)
        if self._previous is not None:
            displacement[0:2] = self._around_previous().project(fix.lat, fix.lon)
            displacement[2] = self._previous.alt - fix.alt
        velocity = np.clip(displacement / dt, -bound, bound)
        self._drift += share * (velocity - self._drift)
        self._judge_above('hdrift', math.hypot(*self._drift[0:2]), limits.req_hdrift)
        self._judge_above('vdrift', abs(float(self._drift[2])), limits.req_vdrift)
        if fix.has_velocity:
            speed = np.clip(fix.velocity[0:2], -bound[0:2], bound[0:2])
            self._speed += share * (speed - self._speed)
            self._judge_above('hspeed', math.hypot(*self._speed), limits.req_hdrift)

    def _around_previous(self) -> Projection:
        assert self._previous is not None
        name = self._f.params.earth.projection
        return make_projection(name, self._previous.lat, self._previous.lon)

    def _forget_drift(self) -> None:
        self._drift[:] = 0.0
        self._speed[:] = 0.0

    def _stamp(self) -> None:
        """Note the time of the verdict."""
        if self.blocking() or not self._ran:
            self.last_fail_us = self._f.t_now
        else:
            self.last_pass_us = self._f.t_now
        self._ran = True
