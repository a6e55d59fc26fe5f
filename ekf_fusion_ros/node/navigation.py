"""Navigation health on topics: home, the three flags, readiness."""

from __future__ import annotations

import math
import time
from typing import Any

from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from sensor_msgs.msg import NavSatFix
from std_msgs.msg import Bool

from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.health.home import Home
from ekf_fusion_ros.health.status import NavigationStatus
from ekf_fusion_ros.live.report import Report
from ekf_fusion_ros.messages.encode_home import HomeFields
from ekf_fusion_ros.messages.encode_home import encode_home
from ekf_fusion_ros.node.qos import latched_qos
from ekf_fusion_ros.node.qos import make_publisher
from ekf_fusion_ros.node.stamps import stamp_message
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.session import FusionSession

FLAGS = ('global_position_valid', 'local_position_valid', 'local_velocity_valid', 'ready')


class NavigationPublisher:
    """Publishes `home`, `home/pose` and `navigation/<flag>` where they change.

    Late subscribers get the latest. A Bool has no stamp, so flags must not stand while time does:
    with no inertial input for `health.timeout` of the steady clock they are false.
    """

    def __init__(self, node: Node, params: Params) -> None:
        def publisher(kind: type, topic: str) -> Any:
            return make_publisher(node, kind, topic, latched_qos())

        self._frame = params.node.output_frame
        self._timeout = params.health.timeout
        self._home = publisher(NavSatFix, 'home')
        self._pose = publisher(PoseStamped, 'home/pose')
        self._flags = {name: publisher(Bool, f'navigation/{name}') for name in FLAGS}
        self._told: dict[str, bool] = {}
        self._told_home: Home | None = None
        self._stamp_us = 0
        self._moved_s = time.monotonic()

    def publish(self, status: NavigationStatus) -> None:
        """Publish what differs from what was published last."""
        if status.time_us != self._stamp_us:
            self._stamp_us, self._moved_s = status.time_us, time.monotonic()
        silent = self._silence() > self._timeout
        for name, publisher in self._flags.items():
            value = bool(getattr(status, name)) and not silent
            if self._told.get(name) is not value:
                self._told[name] = value
                publisher.publish(Bool(data=value))
        if status.home is not None and status.home != self._told_home:
            self._told_home = status.home
            fields = encode_home(status.home)
            self._home.publish(home_fix(fields, self._frame))
            if math.isfinite(fields.position[0]):
                self._pose.publish(home_pose(fields, self._frame))

    def report(self, session: FusionSession) -> Report:
        """Report navigation in one sentence."""
        health, silence = session.navigation_health(), self._silence()
        if self._stamp_us and silence > self._timeout:
            return Report('navigation', HealthLevel.ERROR, 'position and velocity not valid: no '
                          f'inertial input for {silence:.0f} s', health.values)
        return Report('navigation', health.level, health.text, health.values)

    def _silence(self) -> float:
        return time.monotonic() - self._moved_s


def home_fix(fields: HomeFields, frame_id: str) -> NavSatFix:
    """Return home on the globe."""
    message = NavSatFix(
        latitude=fields.latitude, longitude=fields.longitude, altitude=fields.altitude)
    message.header.stamp = stamp_message(fields.time_us)
    message.header.frame_id = frame_id
    message.status.service = message.status.SERVICE_GPS
    return message


def home_pose(fields: HomeFields, frame_id: str) -> PoseStamped:
    """Return home in the map frame."""
    message = PoseStamped()
    message.header.stamp = stamp_message(fields.time_us)
    message.header.frame_id = frame_id
    pose = message.pose
    pose.position.x, pose.position.y, pose.position.z = fields.position
    turn = pose.orientation
    turn.x, turn.y, turn.z, turn.w = fields.orientation
    return message
