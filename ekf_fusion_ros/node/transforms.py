"""TF by the rules of REP-105: odom -> base_link, or map -> odom beside an odometry; never both."""

from __future__ import annotations

from collections.abc import Callable
import time
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile

from ekf_fusion_ros import frames
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.live.map_to_odom import MapToOdom
from ekf_fusion_ros.live.report import Report
from ekf_fusion_ros.live.transform_watch import Key
from ekf_fusion_ros.live.transform_watch import TransformWatch
from ekf_fusion_ros.mathlib.rigid import Pose
from ekf_fusion_ros.messages.odometry_pose import odometry_pose
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.node.guard import Guard
from ekf_fusion_ros.node.optional import imported
from ekf_fusion_ros.node.stamps import stamp_message
from ekf_fusion_ros.params.messages import OdometryMessageParams
from ekf_fusion_ros.params.node import NodeParams
from ekf_fusion_ros.params.tree import Params

TOPIC = '/tf'
DEPTH = 100


class Transforms:
    """Publishes one transform for each output, unless another node publishes it.

    `odometry` gives the mounting of the odometry sensor, `send` publishes TransformStamped.
    """

    def __init__(
        self, params: Params, odometry: Callable[[], OdometryMessageParams],
        send: Callable[[list[TransformStamped]], None], warn: Callable[[str], None],
    ) -> None:
        node = params.node
        self._node = node
        self._odometry = odometry
        self._send = send
        self._warn = warn
        self._offset_us = round(1e6 * node.transform_time_offset)
        self._in_map = node.output_frame == node.map_frame
        self._parent, self._child = (
            (node.map_frame, node.odom_frame) if self._in_map
            else (node.odom_frame, node.base_link_frame))
        self._map_to_odom = MapToOdom()
        self._watch = TransformWatch(self._parent, self._child)

    def note_odometry(self, message: Any) -> None:
        """Take an odometry message that goes to the filter, before its outputs."""
        if not self._in_map:
            return
        try:
            pose = odometry_pose(message, self._node.odom_frame, self._odometry())
        except Refused as refusal:
            if refusal.reason == 'wrong_frame' and refusal.detail != self._watch.trouble:
                self._watch.trouble = refusal.detail
                self._warn(self._watch.sentence(time.monotonic()))
            return
        self._watch.trouble = ''
        self._map_to_odom.odometry.push(*pose)

    def publish(self, nav: NavState) -> None:
        """Publish the transform that goes with a state in the output frame."""
        pose: Pose | None = Pose(
            frames.swap_enu_ned(nav.position), frames.swap_attitude(nav.quaternion))
        if self._in_map:
            assert pose is not None
            self._map_to_odom.fused.push(nav.time_us, pose)
            pose = self._map_to_odom.transform()
        now = time.monotonic()
        news = self._watch.news(now)
        if news:
            self._warn(news)
        if pose is None or self._watch.trouble or not self._watch.free(now):
            return
        message = transform_message(
            nav.time_us + self._offset_us, self._parent, self._child, pose)
        self._watch.note_own(key_of(message))
        self._send([message])

    def hear(self, message: Any) -> None:
        """Take a TFMessage of anybody."""
        now = time.monotonic()
        for one in message.transforms:
            if one.child_frame_id.lstrip('/') == self._child:
                self._watch.hear(one.header.frame_id, key_of(one), now)

    def report(self) -> Report:
        """Say what is published, or why nothing is."""
        return self._watch.report(time.monotonic())


def make_transforms(
    node: Node, params: Params, odometry: Callable[[], OdometryMessageParams], guard: Guard,
) -> Transforms | None:
    """Return what publishes TF, None where that is not wanted.

    Raises ValueError, in one sentence, where it is wanted and cannot be.
    """
    if not params.node.publish_tf:
        return None
    check_frames(params.node)
    kind = imported('tf2_msgs.msg', 'TFMessage')
    if kind is None:
        raise ValueError('node.publish_tf is true, but tf2_msgs cannot be imported: install '
                         'ros-jazzy-tf2-msgs, or set it to false')
    publisher = node.create_publisher(kind, TOPIC, QoSProfile(depth=DEPTH))
    transforms = Transforms(
        params, odometry, lambda messages: publisher.publish(kind(transforms=messages)),
        lambda text: node.get_logger().warning(text))
    node.create_subscription(kind, TOPIC, guard(transforms.hear), QoSProfile(depth=DEPTH))
    return transforms


def check_frames(params: NodeParams) -> None:
    """Raise ValueError for frames between which TF has no place for a transform of ours."""
    names = params.map_frame, params.odom_frame, params.base_link_frame
    if len(set(names)) < len(names):
        raise ValueError(f'node.publish_tf: map_frame, odom_frame and base_link_frame are '
                         f'{", ".join(names)}: they must differ')
    if params.output_frame not in names[:2]:
        raise ValueError(f'node.publish_tf: world_frame {params.output_frame!r} must be that of '
                         f'map_frame {names[0]!r} or of odom_frame {names[1]!r}')
    if params.output_frame == params.map_frame and not params.use_odometry:
        raise ValueError('node.publish_tf: map -> odom needs the odometry to compare with: set '
                         'node.use_odometry to true, or node.world_frame to the odom_frame')


def transform_message(time_us: int, parent: str, child: str, pose: Pose) -> TransformStamped:
    """Return the ROS message of a transform."""
    message = TransformStamped()
    message.header.stamp = stamp_message(time_us)
    message.header.frame_id, message.child_frame_id = parent, child
    place, turn = message.transform.translation, message.transform.rotation
    place.x, place.y, place.z = pose.position.tolist()
    turn.w, turn.x, turn.y, turn.z = pose.quaternion.tolist()
    return message


def key_of(message: TransformStamped) -> Key:
    """Return what tells a transform from others."""
    stamp, place = message.header.stamp, message.transform.translation
    return stamp.sec * 10**9 + stamp.nanosec, place.x, place.y, place.z
