"""Keeps exceptions inside callbacks: nothing that one message does may end the node."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
import traceback
from typing import Any

from rclpy.node import Node

INTERNAL_ERROR = 'internal error, see the log of the node'


class Guard:
    """Counts an error nobody expected as `internal_errors` and logs each kind once."""

    def __init__(self, node: Node, trouble: Counter[str]) -> None:
        self._node = node
        self._trouble = trouble
        self._told: set[str] = set()

    def __call__(self, work: Callable[..., Any]) -> Callable[..., None]:
        """Return `work` as a callback that cannot raise."""
        def call(*arguments: Any) -> None:
            try:
                work(*arguments)
            except Exception as error:  # nothing may leave a callback
                self.tell(work.__name__.strip('_').replace('_', ' '), error)
        return call

    def tell(self, where: str, error: Exception) -> None:
        """Count an error; log it where it is new."""
        self._trouble['internal_errors'] += 1
        sentence = f'internal error at {where}, the node goes on: {type(error).__name__}: {error}'
        if sentence in self._told:
            return
        self._told.add(sentence)
        self._node.get_logger().error(
            f'{sentence}\n{"".join(traceback.format_exception(error))}')
