"""Collects what there is to say of the node: for /diagnostics, and for the log."""

from __future__ import annotations

from collections.abc import Callable
import time

from rclpy.node import Node

from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.output_watch import OutputWatch
from ekf_fusion_ros.live.receiver_checks import receiver_report
from ekf_fusion_ros.live.receiver_reports import receiver_status_report
from ekf_fusion_ros.live.report import Report
from ekf_fusion_ros.live.situation import PREPARING
from ekf_fusion_ros.live.situation import situation
from ekf_fusion_ros.live.switches import Switches
from ekf_fusion_ros.live.work_watch import EstimatorWatch
from ekf_fusion_ros.live.work_watch import WorkWatch
from ekf_fusion_ros.node.diagnostics import make_diagnostics
from ekf_fusion_ros.node.inputs import Inputs
from ekf_fusion_ros.node.navigation import NavigationPublisher
from ekf_fusion_ros.session import FusionSession

LATE = ('too_old', 'backward_stamp')


class Reporting:
    """Says one sentence of state, and one line for each source, the checks, work and output."""

    def __init__(
        self, node: Node, session: FusionSession, inputs: Inputs, switches: Switches,
        work: WorkWatch, navigation: NavigationPublisher, queued: Callable[[], int],
    ) -> None:
        self._node = node
        self._session = session
        self._inputs = inputs
        self._switches = switches
        self._work = work
        self._navigation = navigation
        self._queued = queued
        self._diagnostics = make_diagnostics(node)
        self._estimator = EstimatorWatch()
        self._newest_us: int | None = None
        self.output = OutputWatch(
            node.resolve_topic_name('odometry/filtered'), time.monotonic())
        self.preparing = False
        self.further: list[Callable[[], Report]] = []

    def note_output(self, time_us: int) -> None:
        """Note that an estimate of this stamp was published."""
        self._newest_us = time_us
        self.output.note(time.monotonic())

    def report(self) -> None:
        """Publish all there is to say; tell the log of a silence."""
        now = time.monotonic()
        health = self._health(now)
        self._diagnostics.publish(self._reports(health, now))
        line = self.output.due(now, health.text)
        if line and self.output.silent:
            self._node.get_logger().warning(line)
        elif line:
            self._node.get_logger().info(line)

    def _health(self, now: float) -> Health:
        if self.preparing:
            return Health(HealthLevel.WARN, PREPARING, {})
        session = self._session
        counts = session.statistics()
        waiting, inertial = session.waiting_role, session.inertial_role
        return situation(
            session.health(),
            self._inputs.seen(waiting, counts[waiting], now) if waiting else None,
            self._inputs.seen(inertial, counts[inertial], now), enabled=self._switches.enabled)

    def _reports(self, health: Health, now: float) -> list[Report]:
        ros_now = 1e-9 * self._node.get_clock().now().nanoseconds
        counts = self._session.statistics()
        aids = self._session.estimator.aid_statuses()
        reports = [self._estimator.report(health, self._work.trouble, self._queued())]
        reports.append(self._navigation.report(self._session))
        for role, watch in self._inputs.watches.items():
            watch.switched_on = self._switches.is_on(role)
            reports.append(watch.report(
                counts[role], now, aids, self._inputs.delay(role, now, ros_now)))
        receiver = receiver_report(health.values)
        if receiver is not None and 'fix' in self._inputs.watches:
            reports.append(receiver)
        reports += [receiver_status_report(one) for one in self._session.receivers()]
        reports += [further() for further in self.further]
        late = sum(one.refused.get(reason, 0) for one in counts.values() for reason in LATE)
        reports.append(self._work.report(
            now, time.thread_time(), self._queued(), late,
            health.values.get('horizon_delay', '')))
        newest = self._newest_us
        reports.append(self.output.report(
            now, None if newest is None or not ros_now else ros_now - 1e-6 * newest))
        return reports
