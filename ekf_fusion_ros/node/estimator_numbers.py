"""All numbers of the estimator, for PlotJuggler and Foxglove."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_msgs.msg import KeyValue
from rclpy.node import Node

from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.live.numbers import single_numbers
from ekf_fusion_ros.node.qos import output_qos
from ekf_fusion_ros.node.stamps import stamp_message
from ekf_fusion_ros.session import FusionSession


class EstimatorNumbers:
    """`~/estimator`: states, variances, innovations, test ratios and resets, a number a key."""

    def __init__(self, node: Node, session: FusionSession) -> None:
        self._session = session
        self._name = node.get_fully_qualified_name().lstrip('/')
        self._publisher = node.create_publisher(DiagnosticArray, '~/estimator', output_qos())
        self._told_us = 0

    def publish(self) -> None:
        """Publish the newest state, where there is a newer one than before."""
        nav = self._session.estimator.nav_state()
        if nav is None or nav.time_us == self._told_us:
            return
        self._told_us = nav.time_us
        message = DiagnosticArray()
        message.header.stamp = stamp_message(nav.time_us)
        message.status = [self._status(self._session.estimator.health())]
        self._publisher.publish(message)

    def _status(self, health: Health) -> DiagnosticStatus:
        values = {**health.values, **{
            f'reset.{name}': str(count) for name, count in self._session.resets().items()}}
        return DiagnosticStatus(
            level=bytes([health.level]), name=f'{self._name}: numbers', message=health.text,
            hardware_id='none',
            values=[KeyValue(key=key, value=value)
                    for key, value in single_numbers(values).items()])
