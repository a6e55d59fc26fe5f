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

from ekf_fusion_ros.airspeed_conditions import BELOW_THRESHOLD
from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.statistics import RoleStatistics

TROUBLE = {
    'internal_errors': 'internal errors, see the log',
    'stalls': 'times busy for long, inputs may be lost: is the computer overloaded?',
}
# Roles that need not speak while nothing changes.
TOLD_ON_CHANGE = ('landed', 'armed')
# Why messages are refused while all is well: a vehicle that is slow or parked.
EXPECTED_REASONS = (BELOW_THRESHOLD,)


@dataclass(frozen=True, slots=True)
class Report:
    """One line of diagnostics: a subject, its level, one sentence and the numbers behind it."""

    subject: str
    level: HealthLevel
    text: str
    values: Mapping[str, str] = field(default_factory=dict)


class EstimatorWatch:
    """Reports the estimator, and what went wrong in the node itself since the last report."""

    def __init__(self) -> None:
        self._trouble: Mapping[str, int] = {}

    def report(self, health: Health, trouble: Mapping[str, int], queued: int) -> Report:
        """Report health; `trouble` counts by name, `queued` messages wait for the filter."""
        values = {**health.values, 'queued': str(queued)}
        values.update({name: str(count) for name, count in trouble.items()})
        new = {name: count - self._trouble.get(name, 0) for name, count in trouble.items()}
        self._trouble = dict(trouble)
        words = [f'{count} {TROUBLE[name]}' for name, count in new.items() if count]
        level = max(health.level, HealthLevel.WARN) if words else health.level
        return Report('estimator', level, '; '.join([health.text, *words]), values)


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
        refused = sum(
            count for why, count in counts.refused.items() if why not in EXPECTED_REASONS)
        new_refused = refused - self._refused
        self._received, self._refused = counts.received, refused
        reasons = sorted(counts.refused.items())
        values = {
            'topic': self._topic, 'received': str(counts.received),
            'accepted': str(counts.accepted), 'pending': str(counts.pending),
            'refused': str(counts.refused_total)}
        values.update({f'refused.{reason}': str(count) for reason, count in reasons})
        values.update({f'detail.{reason}': counts.details[reason] for reason, _ in reasons})
        silent = not new and not (counts.received and self._role in TOLD_ON_CHANGE)
        level = HealthLevel.WARN if new_refused or silent else HealthLevel.OK
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
