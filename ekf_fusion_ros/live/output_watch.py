"""Whether anything is published, how often, and when to say why not."""

from __future__ import annotations

from collections import deque
import re

from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.report import Report

SILENCE_S = 1.0
REPEAT_S = 10.0
RATE_WINDOW_S = 5.0


class OutputWatch:
    """Counts what is published, and tells the log of silence and of its end.

    Times are s of a clock that never stands still.
    """

    def __init__(self, topic: str, now: float) -> None:
        self._topic = topic
        self._published = 0
        self._last = now
        self._counted: deque[tuple[float, int]] = deque()
        self._said = ''
        self._said_at = now
        self.silent = True

    def note(self, now: float) -> None:
        """Note one published estimate."""
        self._published += 1
        self._last = now

    def report(self, now: float, delay: float | None) -> Report:
        """Report rate and age; `delay`: of the newest stamp against the node's clock in s."""
        while self._counted and now - self._counted[0][0] > RATE_WINDOW_S:
            self._counted.popleft()
        self._counted.append((now, self._published))
        elapsed = now - self._counted[0][0]
        rate = (self._published - self._counted[0][1]) / elapsed if elapsed > 0.0 else 0.0
        silent = not self._published or now - self._last > SILENCE_S
        text = f'nothing on {self._topic}' if silent else f'{self._topic} at {rate:.1f} Hz'
        values = {'published': str(self._published), 'rate': f'{rate:.1f}',
                  'age': f'{now - self._last:.3f}' if self._published else '',
                  'delay': '' if delay is None else f'{delay:.3f}'}
        return Report('output', HealthLevel.WARN if silent else HealthLevel.OK, text, values)

    def due(self, now: float, reason: str) -> str:
        """Return what the log should be told now, '' for nothing.

        The reason of a silence is repeated when it changes in more than numbers, and every ten
        seconds.
        """
        if self._published and now - self._last <= SILENCE_S:
            was_silent, self.silent, self._said = self.silent, False, ''
            return f'publishing {self._topic}' if was_silent else ''
        kind = re.sub(r'\d+(\.\d+)?', '', reason)
        repeated = kind == self._said and now - self._said_at < REPEAT_S
        if repeated or now - self._last < SILENCE_S:
            return ''
        self.silent, self._said, self._said_at = True, kind, now
        return f'nothing is published: {reason}'
