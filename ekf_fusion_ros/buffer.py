"""The delayed FIFO: samples wait here until the fusion horizon has passed them."""

from __future__ import annotations

from collections import Counter
from collections import deque
from collections.abc import Callable
from typing import Generic
from typing import TypeVar

T = TypeVar('T')

MAX_AGE_US = 100_000
"""A sample older than this against the horizon is too late to be fused."""

TOO_CLOSE = 'too_close'
NEVER = 2 ** 63
OVERTAKEN = 'overtaken'
PUSHED_OUT = 'pushed_out'


class SampleBuffer(Generic[T]):
    """FIFO of fixed capacity, ordered by time; `next_us` is the time of the oldest, or NEVER.

    `newest` stays readable after it has been taken out, but its time is then 0: whoever asks
    "is the newest sample recent" hears "no" until the next one arrives. `passed_over` counts
    the samples that were never handed out: arrived too close to the one before, overtaken by a
    newer one at the horizon, or pushed out by one that arrived while the buffer was full.
    """

    def __init__(self, capacity: int) -> None:
        """Hold at most `capacity` samples; pushing past that drops the oldest."""
        self._waiting: deque[tuple[int, T]] = deque(maxlen=capacity)
        self.next_us = NEVER
        self.newest: T | None = None
        self.newest_time_us = 0
        self.last_arrival_us = 0
        self.passed_over: Counter[str] = Counter()

    def __len__(self) -> int:
        """Return the number of waiting samples."""
        return len(self._waiting)

    def admits(self, arrival_us: int, min_interval_us: int) -> bool:
        """True, and noted as the last arrival, where a sample is not too close to the last one."""
        if arrival_us - self.last_arrival_us <= min_interval_us:
            self.passed_over[TOO_CLOSE] += 1
            return False
        self.last_arrival_us = arrival_us
        return True

    def push(self, time_us: int, sample: T) -> None:
        """Add the newest sample."""
        if len(self._waiting) == self._waiting.maxlen:
            self.passed_over[PUSHED_OUT] += 1
        self._waiting.append((time_us, sample))
        self.next_us = self._waiting[0][0]
        self.newest = sample
        self.newest_time_us = time_us

    def replace(self, change: Callable[[T], T]) -> None:
        """Change every waiting sample."""
        for index, (time_us, sample) in enumerate(self._waiting):
            self._waiting[index] = (time_us, change(sample))

    def pop_first_older_than(self, time_us: int) -> tuple[int, T] | None:
        """Take the newest sample with t <= time_us < t + 100 ms, and drop all before it."""
        if self.next_us > time_us:
            return None
        waiting = self._waiting
        passed, count = 1, len(waiting)
        while passed < count and waiting[passed][0] <= time_us:
            passed += 1
        if time_us >= waiting[passed - 1][0] + MAX_AGE_US:
            return None
        for _ in range(passed - 1):
            waiting.popleft()
            self.passed_over[OVERTAKEN] += 1
        newest_passed = waiting.popleft()
        if waiting:
            self.next_us = waiting[0][0]
        else:
            self.next_us, self.newest_time_us = NEVER, 0
        return newest_passed
