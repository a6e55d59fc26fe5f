"""/tf_static as the source of mountings that the parameters leave at zero."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.qos import QoSProfile

from ekf_fusion_ros.live.static_mounting import StaticMounting
from ekf_fusion_ros.live.tuning import Tuning
from ekf_fusion_ros.mathlib.rigid import Pose
from ekf_fusion_ros.node.guard import Guard
from ekf_fusion_ros.node.optional import imported
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.roles import ODOMETRY

TOPIC = '/tf_static'
DEPTH = 100
WAIT_S = 2.0
"""Time from the first message for which the filter waits for /tf_static, while messages queue."""


class StaticFrames:
    """Looks up the frame of each sensor once and tells the session where it is mounted."""

    def __init__(self, node: Node, params: Params, tuning: Tuning) -> None:
        self._node = node
        self._tuning = tuning
        self._finder = StaticMounting(params, params.node.roles)
        self._since: float | None = None

    def note(self, role: str, message: Any) -> None:
        """Take a message when it arrives."""
        if self._since is None:
            self._since = time.monotonic()
        if self._finder.wants(role):
            self._finder.note(role, sensor_frame(role, message))
            self._mount()

    def hear(self, message: Any) -> None:
        """Take a TFMessage."""
        for one in message.transforms:
            self._finder.tree.add(
                one.header.frame_id.lstrip('/'), one.child_frame_id.lstrip('/'), pose_of(one))
        self._mount()

    def waits(self) -> bool:
        """Return whether the filter should wait; says so of what was waited for in vain."""
        if self._since is None or not self._finder.pending:
            return False
        if time.monotonic() - self._since < WAIT_S:
            return True
        for sentence in self._finder.missing():
            self._node.get_logger().warning(sentence)
        return False

    def _mount(self) -> None:
        changes = self._finder.changes()
        if changes:
            self._tuning.mount(changes)


def make_static_frames(
    node: Node, params: Params, tuning: Tuning, guard: Guard,
) -> StaticFrames | None:
    """Return what looks for mountings in /tf_static, None where that is not wanted or possible."""
    kind = imported('tf2_msgs.msg', 'TFMessage')
    if kind is None or not params.node.mounting_from_tf:
        return None
    frames = StaticFrames(node, params, tuning)
    quality = QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(kind, TOPIC, guard(frames.hear), quality)
    return frames


def sensor_frame(role: str, message: Any) -> str:
    """Return the name of the frame in which a sensor sits."""
    return str(message.child_frame_id if role == ODOMETRY else message.header.frame_id)


def pose_of(message: Any) -> Pose:
    """Return a TransformStamped as the pose of the child in its parent."""
    place, turn = message.transform.translation, message.transform.rotation
    quaternion = np.array((turn.w, turn.x, turn.y, turn.z))
    return Pose(np.array((place.x, place.y, place.z)), quaternion / np.linalg.norm(quaternion))
