"""Puts aiding samples into the order of their stamps before they meet inertial time."""

from __future__ import annotations

from collections.abc import Sequence
import heapq
from typing import Any

from ekf_fusion_ros.buffer import NEVER
from ekf_fusion_ros.roles import SUPPORTED

HELD_MAX = 1000
RANK = {role: rank for rank, role in enumerate(SUPPORTED)}


class Holding:
    """Holds aiding samples until inertial time is `hold_us` past their stamp.

    Middleware does not keep the order of messages across topics. Held this long, and ordered by
    stamp and role, they reach the estimator in one order however they arrived, so that node
    and replay give the same numbers. The fusion horizon lies further back than the hold. `due_us`:
    the inertial stamp from which `release` has something to give, NEVER where nothing is held and
    0 where too much is.
    """

    def __init__(self, hold_us: int) -> None:
        self._hold_us = hold_us
        self._heap: list[tuple[int, int, int, str, Any]] = []
        self._sequence = 0
        self.due_us = NEVER

    def push(self, role: str, sample: Any) -> None:
        """Hold a sample."""
        self._sequence += 1
        entry = (sample.time_us, RANK[role], self._sequence, role, sample)
        heapq.heappush(self._heap, entry)
        due_us = sample.time_us + self._hold_us
        if due_us < self.due_us:
            self.due_us = due_us
        if len(self._heap) > HELD_MAX:
            self.due_us = 0

    def release(self, now_us: int | None) -> Sequence[tuple[str, Any]]:
        """Return what is due before the inertial stamp `now_us`; None: before there is one."""
        limit = -1 if now_us is None else now_us - self._hold_us
        heap, due = self._heap, []
        while heap and (heap[0][0] <= limit or len(heap) > HELD_MAX):
            due.append(heapq.heappop(heap)[3:])
        if due:
            self.due_us = heap[0][0] + self._hold_us if heap else NEVER
        return due

    def flush(self) -> Sequence[tuple[str, Any]]:
        """Return everything, oldest stamp first."""
        due = [entry[3:] for entry in sorted(self._heap)]
        self._heap.clear()
        self.due_us = NEVER
        return due
