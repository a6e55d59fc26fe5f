"""The queue between the subscriptions and the filter."""

from __future__ import annotations

from collections import deque
from typing import Any


class Intake:
    """Messages with their roles in order of arrival, bounded.

    A full queue turns the newest message away: those that wait keep their order, so the filter
    sees a gap and not a jumble.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._waiting: deque[tuple[str, Any]] = deque()

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, role: str, message: Any) -> bool:
        """Queue a message; False where there is no room."""
        if len(self._waiting) >= self._limit:
            return False
        self._waiting.append((role, message))
        return True

    def take(self) -> tuple[str, Any]:
        """Return and forget the oldest arrival. Raises IndexError on an empty queue."""
        return self._waiting.popleft()
