"""What the node says of itself on /diagnostics."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import field

from diagnostic_msgs.msg import DiagnosticArray
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_msgs.msg import KeyValue
from rclpy.node import Node

from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.statistics import RoleStatistics


@dataclass(frozen=True, slots=True)
class Report:
    """One line of diagnostics: a subject, its level, one sentence and the numbers behind it."""

    subject: str
    level: HealthLevel
    text: str
    values: Mapping[str, str] = field(default_factory=dict)


def estimator_report(health: Health, trouble: Mapping[str, int]) -> Report:
    """Report the estimator; `trouble` counts by name what went wrong in the node itself."""
    values = {**health.values, **{name: str(count) for name, count in trouble.items()}}
    found = [f'{count} {name.replace("_", " ")}' for name, count in trouble.items() if count]
    if not found:
        return Report('estimator', health.level, health.text, values)
    text = f'{health.text}; in the node: {", ".join(found)}'
    return Report('estimator', max(health.level, HealthLevel.WARN), text, values)


class TopicWatch:
    """Turns the counts of one role into a report, level by what is new since the last one."""

    def __init__(self, role: str, topic: str) -> None:
        self._role = role
        self._topic = topic
        self._received = 0
        self._refused = 0

    def report(self, counts: RoleStatistics) -> Report:
        """Report the counts and what changed."""
        new = counts.received - self._received
        new_refused = counts.refused_total - self._refused
        self._received, self._refused = counts.received, counts.refused_total
        reasons = sorted(counts.refused.items())
        values = {
            'topic': self._topic, 'received': str(counts.received),
            'accepted': str(counts.accepted), 'pending': str(counts.pending),
            'refused': str(counts.refused_total)}
        values.update({f'refused.{reason}': str(count) for reason, count in reasons})
        values.update({f'detail.{reason}': counts.details[reason] for reason, _ in reasons})
        level = HealthLevel.WARN if new_refused or not new else HealthLevel.OK
        return Report(self._role, level, self._sentence(counts, new), values)

    def _sentence(self, counts: RoleStatistics, new: int) -> str:
        if not counts.received:
            return f'nothing received on {self._topic} yet'
        words = [f'{counts.received} received on {self._topic}']
        if not new:
            words.append('none since the last report')
        words += [f'{count} refused: {reason}' for reason, count in sorted(counts.refused.items())]
        return ', '.join(words)


class DiagnosticsPublisher:
    """Publishes reports as a DiagnosticArray, one status per subject."""

    def __init__(self, node: Node) -> None:
        self._node = node
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
            name=f'{self._node.get_name()}: {report.subject}',
            message=report.text,
            hardware_id='none',
            values=[KeyValue(key=key, value=value) for key, value in report.values.items()])
