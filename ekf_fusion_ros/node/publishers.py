"""The published estimates."""

from __future__ import annotations

from typing import Any

from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import NavSatFix

from ekf_fusion_ros.fused_output import FusedOutput
from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.messages.encode import NavSatFixFields
from ekf_fusion_ros.messages.encode import OdometryFields
from ekf_fusion_ros.messages.encode import encode_fix
from ekf_fusion_ros.messages.encode import encode_gnss_odometry
from ekf_fusion_ros.messages.encode import encode_odometry
from ekf_fusion_ros.node.qos import make_publisher
from ekf_fusion_ros.node.qos import output_qos
from ekf_fusion_ros.node.stamps import stamp_message
from ekf_fusion_ros.node.surroundings import SurroundingsPublisher
from ekf_fusion_ros.params.tree import Params


class Publishers:
    """`odometry/filtered`, `odometry/gps`, `gps/filtered` and company from fused outputs."""

    def __init__(self, node: Node, params: Params) -> None:
        def publisher(kind: type, name: str) -> Any:
            return make_publisher(node, kind, name, output_qos())

        self._params = params
        self._odometry = publisher(Odometry, 'odometry/filtered')
        self._gps = publisher(Odometry, 'odometry/gps')
        self._fix = publisher(NavSatFix, 'gps/filtered')
        self._surroundings = SurroundingsPublisher(node, params)

    def publish(self, output: FusedOutput) -> None:
        """Publish one output and the fixes that came with it.

        Positions on the globe wait for the origin.
        """
        names = self._params.node
        world, body = names.output_frame, names.base_link_frame
        self._odometry.publish(
            odometry_message(encode_odometry(output.nav, world, body)))
        self._surroundings.publish(output.nav)
        origin = output.nav.origin
        if output.local or origin is None:
            return
        projection = make_projection(
            self._params.ekf2.earth.projection, origin.lat, origin.lon, origin.alt)
        self._fix.publish(fix_message(encode_fix(output.nav, projection, body)))
        for fix in output.fixes:
            self._gps.publish(
                odometry_message(encode_gnss_odometry(fix, origin, projection, world)))


def odometry_message(fields: OdometryFields) -> Odometry:
    """Return the ROS message with these fields."""
    message = Odometry()
    message.header.stamp = stamp_message(fields.time_us)
    message.header.frame_id = fields.frame_id
    message.child_frame_id = fields.child_frame_id
    pose, twist = message.pose.pose, message.twist.twist
    pose.position.x, pose.position.y, pose.position.z = fields.position
    turn = pose.orientation
    turn.x, turn.y, turn.z, turn.w = fields.orientation
    twist.linear.x, twist.linear.y, twist.linear.z = fields.linear
    twist.angular.x, twist.angular.y, twist.angular.z = fields.angular
    message.pose.covariance = fields.pose_covariance
    message.twist.covariance = fields.twist_covariance
    return message


def fix_message(fields: NavSatFixFields) -> NavSatFix:
    """Return the ROS message with these fields."""
    message = NavSatFix()
    message.header.stamp = stamp_message(fields.time_us)
    message.header.frame_id = fields.frame_id
    message.status.status = fields.status
    message.status.service = fields.service
    message.latitude = fields.latitude
    message.longitude = fields.longitude
    message.altitude = fields.altitude
    message.position_covariance = fields.position_covariance
    message.position_covariance_type = fields.position_covariance_type
    return message
