"""What went wrong in the node itself, and how busy it is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.report import Report

TROUBLE = {
    'internal_errors': 'internal errors, see the log',
    'stalls': 'times busy for long, inputs may be lost: is the computer overloaded?',
}
BUSY_SHARE = 0.9


class EstimatorWatch:
    """Reports the estimator, and what went wrong in the node itself since the last report."""

    def __init__(self) -> None:
        self._trouble: Mapping[str, int] = {}

    def report(self, health: Health, trouble: Mapping[str, int], queued: int) -> Report:
        """Report health; `trouble` counts by name, `queued` messages wait for the filter."""
        values = {**health.values, 'queued': str(queued)}
        values.update({name: str(count) for name, count in trouble.items()})
        new = {name: count - self._trouble.get(name, 0) for name, count in trouble.items()}
        self._trouble = dict(trouble)
        words = [f'{count} {TROUBLE[name]}' for name, count in new.items() if count]
        level = max(health.level, HealthLevel.WARN) if words else health.level
        return Report('estimator', level, '; '.join([health.text, *words]), values)


class WorkWatch:
    """Measures the runs of the core and counts the stalls between them; times in s."""

    def __init__(self, period: float, stall: float) -> None:
        """Expect a run every `period`; later by more than `stall` is trouble."""
        self._period = period
        self._stall = stall
        self._last_start: float | None = None
        self._since: float | None = None
        self._busy = 0.0
        self._longest = 0.0
        self._runs = 0
        self._cpu = 0.0
        self.trouble: Counter[str] = Counter(internal_errors=0, stalls=0)

    def begin(self, now: float) -> None:
        """Note that a run begins."""
        if self._last_start is not None and now > self._last_start + self._period + self._stall:
            # The queues of DDS are short and overwrite without a word: say that it may be so.
            self.trouble['stalls'] += 1
        self._last_start = now
        if self._since is None:
            self._since = now

    def end(self, now: float) -> None:
        """Note that it ended."""
        if self._last_start is None:
            return
        took = now - self._last_start
        self._busy += took
        self._longest = max(self._longest, took)
        self._runs += 1

    def report(self, now: float, cpu: float, queued: int, late: int, horizon: str) -> Report:
        """Report since the last report.

        cpu: time in s that the thread has computed so far, messages that come included; `queued`
        messages wait; `late` ones came too late for the horizon, `horizon` s behind now.
        """
        elapsed = now - (now if self._since is None else self._since)
        per_second = 1.0 / elapsed if elapsed > 0.0 else 0.0
        core, thread = self._busy * per_second, (cpu - self._cpu) * per_second
        share = max(core, thread)
        values = {
            'busy_share': f'{core:.3f}', 'thread_share': f'{thread:.3f}',
            'longest_run_ms': f'{1e3 * self._longest:.2f}',
            'runs': str(self._runs), 'queued': str(queued), 'late_samples': str(late),
            'horizon_delay': horizon}
        level = HealthLevel.WARN if share > BUSY_SHARE else HealthLevel.OK
        text = f'busy {100 * share:.0f} % of the time, {queued} messages waiting'
        self._since, self._busy, self._longest, self._runs = now, 0.0, 0.0, 0
        self._cpu = cpu
        return Report('timing', level, text, values)
