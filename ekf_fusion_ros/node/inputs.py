"""The subscriptions: one topic a role, and what is known of who publishes there."""

from __future__ import annotations

from collections.abc import Callable
import time
from typing import Any

from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import PoseWithCovarianceStamped
from geometry_msgs.msg import TwistStamped
from geometry_msgs.msg import TwistWithCovarianceStamped
from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import FluidPressure
from sensor_msgs.msg import Imu
from sensor_msgs.msg import MagneticField
from sensor_msgs.msg import NavSatFix
from sensor_msgs.msg import Range
from std_msgs.msg import Bool

from ekf_fusion_ros.live.publishers_seen import PublisherSeen
from ekf_fusion_ros.live.publishers_seen import publishers_phrase
from ekf_fusion_ros.live.situation import InputSeen
from ekf_fusion_ros.live.source_watch import SourceWatch
from ekf_fusion_ros.node.qos import input_qos
from ekf_fusion_ros.node.qos import subscription_events
from ekf_fusion_ros.params.node import NodeParams
from ekf_fusion_ros.statistics import RoleStatistics

TOPICS = {
    'odometry': ('odom', Odometry),
    'fix': ('fix', NavSatFix),
    'imu': ('imu', Imu),
    'fix_velocity': ('fix_velocity', TwistWithCovarianceStamped),
    'magnetic_field': ('mag', MagneticField),
    'pressure': ('pressure', FluidPressure),
    'range': ('range', Range),
    'flow': ('flow', Vector3Stamped),
    'airspeed': ('airspeed', TwistWithCovarianceStamped),
    'landed': ('landed', Bool),
    'armed': ('armed', Bool),
    'gps_heading': ('gps_heading', PoseWithCovarianceStamped),
    'aux_velocity': ('aux_velocity', TwistWithCovarianceStamped),
    'fix_2': ('fix_2', NavSatFix),
    'fix_velocity_2': ('fix_velocity_2', TwistWithCovarianceStamped),
    'fix_3': ('fix_3', NavSatFix),
    'fix_velocity_3': ('fix_velocity_3', TwistWithCovarianceStamped),
}
# Messages other than the usual ones, by the word in node.<role>_type.
OTHER_TYPES = {'twist': TwistStamped, 'pose': PoseStamped, 'imu': Imu}
RELIABILITY = {
    ReliabilityPolicy.RELIABLE: 'reliable', ReliabilityPolicy.BEST_EFFORT: 'best-effort'}


class Inputs:
    """Subscribes to the topics of the roles in use and hands messages on by role."""

    def __init__(
        self, node: Node, params: NodeParams, take: Callable[[str, Any], None],
    ) -> None:
        self._node = node
        self._params = params
        self._take = take
        self._newest: dict[str, Any] = {}
        self.watches = {
            role: SourceWatch(role, node.resolve_topic_name(TOPICS[role][0]))
            for role in params.roles}

    def subscribe(self) -> None:
        """Begin to listen; say to what, and to what not."""
        for role in self._params.roles:
            self._subscribe(role)
        unused = [role for role in TOPICS if role not in self._params.roles]
        if unused:
            self._node.get_logger().info(
                f'not listening to {", ".join(unused)}: set node.use_<name> to true to do so')

    def _subscribe(self, role: str) -> None:
        topic, kind, watch = TOPICS[role][0], self._kind(role), self.watches[role]

        def arrive(message: Any) -> None:
            watch.arrived = time.monotonic()
            self._newest[role] = message
            self._take(role, message)

        self._node.create_subscription(
            kind, topic, arrive, input_qos(role),
            event_callbacks=subscription_events(self._node, watch.topic),
            qos_overriding_options=QoSOverridingOptions.with_default_policies())
        self._node.get_logger().info(f'{role}: {kind.__name__} on {watch.topic}')

    def _kind(self, role: str) -> Any:
        word = getattr(self._params, f'{role}_type', '')
        return OTHER_TYPES.get(word, TOPICS[role][1])

    def seen(self, role: str, counts: RoleStatistics, now: float) -> InputSeen:
        """Return what is known of the input of a role at time.monotonic() `now`."""
        watch = self.watches[role]
        return InputSeen(
            role, watch.topic, counts, watch.age(now), lambda: self.publishers(role))

    def publishers(self, role: str) -> str:
        """Return in words who publishes on the topic of a role."""
        infos = self._node.get_publishers_info_by_topic(self.watches[role].topic)
        seen = [
            PublisherSeen(RELIABILITY.get(info.qos_profile.reliability, 'other'), info.topic_type)
            for info in infos]
        return publishers_phrase(seen, type_name(self._kind(role)))

    def delay(self, role: str, now: float, ros_now: float) -> float | None:
        """Return the time in s from stamp to arrival of the newest message.

        `now` is time.monotonic(), `ros_now` the clock of the node in s. None without a stamp, and
        while /clock has not come.
        """
        age = self.watches[role].age(now)
        header = getattr(self._newest.get(role), 'header', None)
        if age is None or header is None or ros_now == 0.0:
            return None
        return ros_now - age - (header.stamp.sec + 1e-9 * header.stamp.nanosec)


def type_name(kind: Any) -> str:
    """Return the name of a message class as ROS spells it, as in nav_msgs/msg/Odometry."""
    package = kind.__module__.partition('.')[0]
    return f'{package}/msg/{kind.__name__}'
