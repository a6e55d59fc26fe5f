"""What happens in the filter, to the log and to a topic."""

from __future__ import annotations

from collections.abc import Iterable

from rcl_interfaces.msg import Log
from rclpy.node import Node

from ekf_fusion_ros.estimator import Event
from ekf_fusion_ros.node.qos import events_qos
from ekf_fusion_ros.node.stamps import stamp_message

INFO = 20
"""Log.INFO, which is a number in some releases of rcl_interfaces and a byte in others."""


class EventsPublisher:
    """`~/events`: resets, starts, stops and refusals as log messages, stamped as their cause.

    A late subscriber gets the last hundred.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher = node.create_publisher(Log, '~/events', events_qos())

    def publish(self, events: Iterable[Event]) -> None:
        """Tell events."""
        for event in events:
            self._node.get_logger().info(f'{event.time_us / 1e6:.3f} s: {event.text}')
            message = Log(level=INFO, msg=event.text)
            message.stamp = stamp_message(event.time_us)
            message.name = self._node.get_fully_qualified_name().lstrip('/')
            self._publisher.publish(message)
