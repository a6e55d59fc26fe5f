"""Receiver quality checks that gate the origin and the start of GNSS aiding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.geo.projection import Projection
from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.samples import GnssSample

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


class _LimitedMean:
    """Low-pass filtered components, each input of which is limited."""

    def __init__(self, size: int) -> None:
        self.mean = [0.0] * size

    def follow(self, values: Sequence[float], limits: Sequence[float], share: float) -> None:
        """Move by a share towards values, limited to INPUT_LIMIT times their limits."""
        for k, (value, limit) in enumerate(zip(values, limits, strict=True)):
            bound = INPUT_LIMIT * limit
            self.mean[k] += share * (min(max(value, -bound), bound) - self.mean[k])

    def forget(self) -> None:
        """Begin again at zero."""
        self.mean = [0.0] * len(self.mean)


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
        self._drift = _LimitedMean(3)
        self._speed = _LimitedMean(2)
        self._climb = _LimitedMean(1)
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
            self._climb.follow((difference,), (limit,), share)
            self._judge_above('vspeed', abs(self._climb.mean[0]), limit)
        self._previous = fix
        self._previous_us = f.t_now

    def _drift_at_rest(self, fix: GnssSample, dt: float, share: float) -> None:
        limits = self._f.params.gnss.checks
        north = east = down = 0.0
        if self._previous is not None:
            north, east = self._around_previous().project(fix.lat, fix.lon)
            down = self._previous.alt - fix.alt
        horizontal, vertical = limits.req_hdrift, limits.req_vdrift
        drift = self._drift
        drift.follow((north / dt, east / dt, down / dt), (horizontal, horizontal, vertical), share)
        self._judge_above('hdrift', math.hypot(*drift.mean[0:2]), horizontal)
        self._judge_above('vdrift', abs(drift.mean[2]), vertical)
        if fix.has_velocity:
            self._speed.follow(fix.velocity[0:2].tolist(), (horizontal, horizontal), share)
            self._judge_above('hspeed', math.hypot(*self._speed.mean), horizontal)

    def _around_previous(self) -> Projection:
        assert self._previous is not None
        name = self._f.params.earth.projection
        return make_projection(name, self._previous.lat, self._previous.lon)

    def _forget_drift(self) -> None:
        self._drift.forget()
        self._speed.forget()

    def _stamp(self) -> None:
        """Note the time of the verdict."""
        if self.blocking() or not self._ran:
            self.last_fail_us = self._f.t_now
        else:
            self.last_pass_us = self._f.t_now
        self._ran = True
