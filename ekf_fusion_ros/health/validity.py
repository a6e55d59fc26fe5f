"""When a position or velocity counts as valid: threshold, hysteresis, time-out, probation."""

from __future__ import annotations

from ekf_fusion_ros.params.health import HealthParams

SECOND = 1_000_000
SHORTEST_PROBATION = 1.0
LONGEST_PROBATION = 100.0
HYSTERESIS = 2.5
"""A valid estimate may become this much worse than one that is to become valid."""


class ValidityFlag:
    """One flag that clears at once and comes back after a probation without failure.

    Its behaviour is that of PX4's commander as the description of COM_POS_FS_PROB has it, at any
    rate of steps. Probation follows a loss: what was never valid has lost nothing, so that a
    vehicle that is in motion at the start need not wait for long. Times in integer microseconds,
    accuracies 1-sigma in m or m/s.
    """

    def __init__(self, limit: float, params: HealthParams) -> None:
        """Start invalid; `limit` is the accuracy that an estimate must be better than."""
        self._limit = limit
        self._gain = params.probation_gain
        self._takeoff_probation = params.takeoff_probation
        self.valid = False
        self.accuracy = float('nan')
        self.passing = False
        self.probation = SHORTEST_PROBATION
        self.invalid_since_us = 0
        self._was_valid = False
        self._last_fail_us: int | None = None
        self._last_step_us = 0

    @property
    def limit(self) -> float:
        """The accuracy that holds now: wider while the flag is set."""
        return HYSTERESIS * self._limit if self.valid else self._limit

    def step(self, now_us: int, accuracy: float, *, available: bool, landed: bool) -> bool:
        """Judge an estimate; True where the flag has changed.

        available: there is an estimate, and it is not older than the time-out.
        """
        if self._last_fail_us is None:
            self._last_fail_us = self._last_step_us = self.invalid_since_us = now_us
        if landed:
            self.probation = SHORTEST_PROBATION
        before = self.valid
        self.accuracy = accuracy
        self.passing = available and accuracy < self.limit
        if self.passing:
            self._pass(now_us)
        else:
            self._fail(now_us)
        self._last_step_us = now_us
        return self.valid != before

    def _pass(self, now_us: int) -> None:
        assert self._last_fail_us is not None
        if not self.valid:
            self.valid = now_us - self._last_fail_us > round(self.probation * SECOND)
            self._was_valid |= self.valid
            return
        good = (now_us - self._last_step_us) / SECOND
        self.probation = max(self.probation - good, SHORTEST_PROBATION)

    def _fail(self, now_us: int) -> None:
        assert self._last_fail_us is not None
        if self.valid:
            self.invalid_since_us = now_us
        elif self._was_valid:
            bad = (now_us - self._last_fail_us) / SECOND
            longer = self.probation + self._gain * bad
            self.probation = min(longer, LONGEST_PROBATION)
        self.valid = False
        self._last_fail_us = now_us

    def take_off(self) -> None:
        """Ask for a longer probation from the next loss on."""
        self.probation = self._takeoff_probation

    def withdraw(self, now_us: int) -> bool:
        """Clear the flag whatever the estimate says; True where it was set."""
        changed, self.valid, self.passing = self.valid, False, False
        if changed:
            self.invalid_since_us = now_us
        self._last_fail_us = self._last_step_us = now_us
        return changed

    def remaining(self) -> float:
        """Return the probation in s that a good estimate has still to pass, 0 without one."""
        if self.valid or not self.passing or self._last_fail_us is None:
            return 0.0
        return max(self.probation - (self._last_step_us - self._last_fail_us) / SECOND, 0.0)
