"""Published beside the odometry: acceleration, wind, ground."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import AccelWithCovarianceStamped
from geometry_msgs.msg import PointStamped
from geometry_msgs.msg import TwistWithCovarianceStamped
from rclpy.node import Node

from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.messages.encode_surroundings import encode_acceleration
from ekf_fusion_ros.messages.encode_surroundings import encode_ground
from ekf_fusion_ros.messages.encode_surroundings import encode_wind
from ekf_fusion_ros.node.qos import make_publisher
from ekf_fusion_ros.node.qos import output_qos
from ekf_fusion_ros.node.stamps import stamp_message
from ekf_fusion_ros.params.tree import Params


class SurroundingsPublisher:
    """`accel/filtered` on request; `wind` and `terrain` while they are estimated."""

    def __init__(self, node: Node, params: Params) -> None:
        def publisher(kind: type, topic: str) -> Any:
            return make_publisher(node, kind, topic, output_qos())

        self._world = params.node.output_frame
        self._body = params.node.base_link_frame
        self._noise = params.ekf2.imu.accel_noise
        self._accel = None
        if params.node.publish_acceleration:
            self._accel = publisher(AccelWithCovarianceStamped, 'accel/filtered')
        self._wind = publisher(TwistWithCovarianceStamped, 'wind')
        self._terrain = publisher(PointStamped, 'terrain')

    def publish(self, nav: NavState) -> None:
        """Publish what a state knows of them."""
        if self._accel is not None:
            self._publish_acceleration(self._accel, nav)
        wind, ground = encode_wind(nav), encode_ground(nav)
        if wind is not None:
            message = TwistWithCovarianceStamped()
            self._head(message, nav, self._world)
            linear = message.twist.twist.linear
            linear.x, linear.y, linear.z = wind.linear
            message.twist.covariance = wind.covariance
            self._wind.publish(message)
        if ground is not None:
            point = PointStamped()
            self._head(point, nav, self._world)
            point.point.x, point.point.y, point.point.z = ground
            self._terrain.publish(point)

    def _publish_acceleration(self, publisher: Any, nav: NavState) -> None:
        fields = encode_acceleration(nav, self._noise)
        if fields is None:
            return
        message = AccelWithCovarianceStamped()
        self._head(message, nav, self._body)
        linear = message.accel.accel.linear
        linear.x, linear.y, linear.z = fields.linear
        message.accel.covariance = fields.covariance
        publisher.publish(message)

    def _head(self, message: Any, nav: NavState, frame_id: str) -> None:
        message.header.stamp = stamp_message(nav.time_us)
        message.header.frame_id = frame_id
