"""/diagnostics: reports by diagnostic_updater where it is installed, by our own hand elsewhere."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any
from typing import Protocol

from diagnostic_msgs.msg import DiagnosticArray
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_msgs.msg import KeyValue
from rclpy.node import Node

from ekf_fusion_ros.live.report import Report

NO_HARDWARE = 'none'
PERIOD = 'diagnostic_updater.period'


class Diagnostics(Protocol):
    """Publishes reports as a DiagnosticArray, one status per subject."""

    def publish(self, reports: Iterable[Report]) -> None:
        """Publish reports, stamped by the node's clock."""


def make_diagnostics(node: Node) -> Diagnostics:
    """Return what publishes the diagnostics of a node."""
    try:
        from diagnostic_updater import Updater
    except ImportError:
        return PlainDiagnostics(node)
    return UpdaterDiagnostics(node, Updater)


class PlainDiagnostics:
    """Builds the DiagnosticArray itself; each status bears the full name of the node."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._name = node.get_fully_qualified_name().lstrip('/')
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)

    def publish(self, reports: Iterable[Report]) -> None:
        """Publish reports, stamped by the node's clock."""
        message = DiagnosticArray()
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.status = [self._status(report) for report in reports]
        self._publisher.publish(message)

    def _status(self, report: Report) -> DiagnosticStatus:
        return DiagnosticStatus(
            level=bytes([report.level]),
            name=f'{self._name}: {report.subject}',
            message=report.text,
            hardware_id=NO_HARDWARE,
            values=[KeyValue(key=key, value=value) for key, value in report.values.items()])


class UpdaterDiagnostics:
    """Hands reports to an Updater, a task for each subject.

    It publishes when it is given reports: the timer of the Updater runs on ROS time and would fall
    silent with /clock, which is when one wants to know why. Its names lack the namespace of the
    node; the hardware id holds it.
    """

    def __init__(self, node: Node, updater: Any) -> None:
        if node.has_parameter(PERIOD):
            # Declared with all that the user has set; the Updater declares it itself.
            node.undeclare_parameter(PERIOD)
        self._updater = updater(node)
        self._updater.timer.cancel()
        self._updater.setHardwareID(node.get_namespace().strip('/') or NO_HARDWARE)
        self._reports: dict[str, Report] = {}

    def publish(self, reports: Iterable[Report]) -> None:
        """Publish reports, stamped by the node's clock."""
        before, self._reports = self._reports, {report.subject: report for report in reports}
        for subject in before.keys() - self._reports.keys():
            self._updater.removeByName(subject)
        for subject in self._reports:
            if subject not in before:
                self._updater.add(subject, self._fill)
        self._updater.force_update()

    def _fill(self, status: Any) -> Any:
        """Complete a status, which bears its subject as its name until it is published."""
        report = self._reports[status.name]
        status.summary(bytes([report.level]), report.text)
        for key, value in report.values.items():
            status.add(key, value)
        return status
