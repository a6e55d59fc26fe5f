"""/diagnostics: reports as a DiagnosticArray.

The messages are those that diagnostic_updater would send; its timer runs on ROS time and falls
silent with /clock, which is when one wants to know why.
"""

from __future__ import annotations

from collections.abc import Iterable

from diagnostic_msgs.msg import DiagnosticArray
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_msgs.msg import KeyValue
from rclpy.node import Node

from ekf_fusion_ros.live.report import Report


class DiagnosticsPublisher:
    """Publishes reports as a DiagnosticArray, one status per subject."""

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
            hardware_id='none',
            values=[KeyValue(key=key, value=value) for key, value in report.values.items()])
