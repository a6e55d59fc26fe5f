"""Stands in for the package of this name, by its documented interface."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_msgs.msg import KeyValue


class Status(DiagnosticStatus):
    """A status with the two methods that tasks call."""

    def summary(self, level: bytes, text: str) -> None:
        self.level, self.message = level, text

    def add(self, key: str, value: str) -> None:
        self.values.append(KeyValue(key=key, value=value))


class Updater:
    """Runs its tasks by a timer on the clock of the node, and when forced to."""

    def __init__(self, node: Any, period: float = 1.0) -> None:
        self._node = node
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 1)
        seconds = node.declare_parameter('diagnostic_updater.period', period).value
        self.timer = node.create_timer(seconds, self.force_update)
        self._tasks: dict[str, Callable[[Any], Any]] = {}
        self._hardware = ''

    def setHardwareID(self, name: str) -> None:  # noqa: N802
        self._hardware = name

    def add(self, name: str, task: Callable[[Any], Any]) -> None:
        assert name not in self._tasks
        self._tasks[name] = task

    def removeByName(self, name: str) -> bool:  # noqa: N802
        return self._tasks.pop(name, None) is not None

    def force_update(self) -> None:
        message = DiagnosticArray()
        message.header.stamp = self._node.get_clock().now().to_msg()
        for name, task in self._tasks.items():
            status = task(Status(name=name, hardware_id=self._hardware))
            message.status.append(DiagnosticStatus(
                name=f'{self._node.get_name()}: {name}', level=status.level,
                message=status.message, hardware_id=status.hardware_id, values=status.values))
        self._publisher.publish(message)
