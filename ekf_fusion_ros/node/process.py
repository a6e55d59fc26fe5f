"""The life of the process: signals, executor, the end."""

from __future__ import annotations

import signal
from types import FrameType

from rclpy.executors import Executor
from rclpy.executors import SingleThreadedExecutor


class StopRequest:
    """Notes SIGINT and SIGTERM, any number of them.

    An exception or an invalid context in the middle of a call tears the executor apart, and
    `ros2 launch` together with the terminal sends SIGINT twice. So signals only leave a note,
    and the node ends between two callbacks with ROS still up.
    """

    def __init__(self) -> None:
        self.made = False
        for kind in (signal.SIGINT, signal.SIGTERM):
            signal.signal(kind, self._note)

    def _note(self, _signal: int, _frame: FrameType | None) -> None:
        self.made = True

    def ignore_more(self) -> None:
        """Let signals pass while Python ends."""
        for kind in (signal.SIGINT, signal.SIGTERM):
            signal.signal(kind, signal.SIG_IGN)


def make_executor() -> Executor:
    """Return the executor that keeps the order of arrival across topics, where there is one.

    The waiting executors serve one message a topic in turn, so a backlog reaches the filter in
    another order than it came.
    """
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor()
    return EventsExecutor()
