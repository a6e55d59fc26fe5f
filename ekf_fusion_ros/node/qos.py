"""Quality of service of the node's topics.

Inputs are best effort, so that they match every publisher; outputs are reliable, because MAVROS
and navigation stacks subscribe with the default reliability. Each entity can be overridden by
the `qos_overrides.*` parameters of ROS 2.
"""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy
from rclpy.qos import HistoryPolicy
from rclpy.qos import QoSProfile
from rclpy.qos import ReliabilityPolicy

SENSOR_DEPTH = 200
IMU_DEPTH = 1000
"""Deep enough for seconds of a busy machine: a message that DDS overwrites is lost unnoticed."""

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


def latched_qos() -> QoSProfile:
    """Return the profile of what changes rarely: a late subscriber gets the latest."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL)
