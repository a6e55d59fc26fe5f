"""Quality of service of the node's topics.

Inputs are best effort, so that they match every publisher; outputs are reliable, because MAVROS
and navigation stacks subscribe with the default reliability. Each entity can be overridden by
the `qos_overrides.*` parameters of ROS 2.
"""

from __future__ import annotations

from typing import Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.qos import HistoryPolicy
from rclpy.qos import QoSProfile
from rclpy.qos import ReliabilityPolicy
from rclpy.qos import qos_policy_name_from_kind
from rclpy.qos_overriding_options import QoSOverridingOptions

SENSOR_DEPTH = 200
IMU_DEPTH = 1000
"""Deep enough for seconds of a busy machine: a message that DDS overwrites is lost unnoticed."""

EVENTS_DEPTH = 100
OUTPUT_DEPTH = 100
"""One odometry message can make ten rows at once."""


def input_qos(role: str) -> QoSProfile:
    """Return the profile of the subscription that serves a role."""
    depth = IMU_DEPTH if role == 'imu' else SENSOR_DEPTH
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)


def output_qos() -> QoSProfile:
    """Return the profile of the published estimates."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=OUTPUT_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE)


def events_qos() -> QoSProfile:
    """Return the profile of events: a late subscriber gets the last ones."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=EVENTS_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def make_publisher(node: Node, kind: type, name: str, profile: QoSProfile) -> Any:
    """Return a publisher whose quality parameters may override, and who tells of a mismatch."""
    return node.create_publisher(
        kind, name, profile,
        event_callbacks=publisher_events(node, node.resolve_topic_name(name)),
        qos_overriding_options=QoSOverridingOptions.with_default_policies())


def subscription_events(node: Node, topic: str) -> SubscriptionEventCallbacks:
    """Return what tells the log of a publisher that this subscription cannot hear."""
    def incompatible(event: Any) -> None:
        node.get_logger().warning(
            f'{topic}: a publisher offers {_policy(event)} that does not match, and nothing of '
            f'it is heard: change it there, or qos_overrides.{topic}.subscription here')
    return SubscriptionEventCallbacks(incompatible_qos=incompatible)


def publisher_events(node: Node, topic: str) -> PublisherEventCallbacks:
    """Return what tells the log of a subscription that cannot hear this publisher."""
    def incompatible(event: Any) -> None:
        node.get_logger().warning(
            f'{topic}: a listener asks for {_policy(event)} that does not match, and hears '
            f'nothing: change it there, or qos_overrides.{topic}.publisher here')
    return PublisherEventCallbacks(incompatible_qos=incompatible)


def _policy(event: Any) -> str:
    """Return the name of the policy in an incompatible-QoS event."""
    return qos_policy_name_from_kind(event.last_policy_kind).lower()


def latched_qos() -> QoSProfile:
    """Return the profile of what changes rarely: a late subscriber gets the latest."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL)
