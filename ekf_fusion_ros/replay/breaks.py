"""Where the output of a run breaks off, and how often the estimator started again."""

from __future__ import annotations

from collections.abc import Sequence

SECOND_US = 1e6
SHORTEST_S = 2.0


class OutputGaps:
    """The longest time without a row after the first one, by stamps."""

    def __init__(self, rate: float) -> None:
        """Take the rate of the rows in Hz, 0 = every filter update."""
        # Rows of a slow rate stand apart by themselves.
        self._shortest_us = SECOND_US * max(SHORTEST_S, 2.0 / rate if rate else 0.0)
        self._first_us: int | None = None
        self._last_us = 0
        self._longest = (0, 0)

    def note(self, times_us: Sequence[int]) -> None:
        """Take the stamps of the next rows."""
        for time_us in times_us:
            if self._first_us is None:
                self._first_us = time_us
            else:
                self._reach(time_us)
            self._last_us = time_us

    def warnings(self, start_us: int, end_us: int) -> list[str]:
        """Say where the longest gap of a replay from start to end is, nothing without one."""
        # Clocks of log and stamps may have nothing to do with each other.
        if self._first_us is not None and start_us <= self._first_us:
            self._reach(end_us)
        begin_us, length_us = self._longest
        if length_us <= self._shortest_us:
            return []
        return [f'no output for {length_us / SECOND_US:.1f} s, from '
                f'{(begin_us - start_us) / SECOND_US:.1f} s after the start on; '
                'it is the longest gap']

    def _reach(self, time_us: int) -> None:
        if time_us - self._last_us > self._longest[1]:
            self._longest = self._last_us, time_us - self._last_us


def restart_warnings(count: int, first_us: int | None, start_us: int) -> list[str]:
    """Say how often the estimator started again, nothing where it did not."""
    if not count:
        return []
    often = 'once' if count == 1 else f'{count} times'
    when = '' if first_us is None else (
        f', {"" if count == 1 else "first "}{(first_us - start_us) / SECOND_US:.1f} s after the '
        'start')
    return [f'the estimator started again {often}{when}; the events say why']
