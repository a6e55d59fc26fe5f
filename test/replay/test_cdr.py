"""CDR bytes written by hand against those of the rosbags library."""

from __future__ import annotations

import numpy as np
import pytest

from ekf_fusion_ros.messages.encode import NavSatFixFields
from ekf_fusion_ros.messages.encode import OdometryFields

typesys = pytest.importorskip('rosbags.typesys')
cdr = pytest.importorskip('ekf_fusion_ros.replay.cdr')

RNG = np.random.default_rng(4)


@pytest.fixture(scope='module')
def store():
    return typesys.get_typestore(typesys.Stores.ROS2_JAZZY)


@pytest.mark.parametrize('frame', ['', 'm', 'map', 'odom_', 'world_enu', 'a' * 13])
@pytest.mark.parametrize('child', ['', 'b', 'base', 'base_link'])
def test_odometry_is_what_rosbags_reads_and_writes(store, frame, child):
    numbers = RNG.normal(size=85)
    fields = OdometryFields(1_432_235_498_123_456, frame, child, numbers)
    data = cdr.odometry_cdr(fields)
    message = store.deserialize_cdr(data, 'nav_msgs/msg/Odometry')
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1432235498, 123456000)
    assert (message.header.frame_id, message.child_frame_id) == (frame, child)
    pose, twist = message.pose.pose, message.twist.twist
    assert (pose.position.x, pose.position.y, pose.position.z) == fields.position
    assert (pose.orientation.x, pose.orientation.w) == (numbers[3], numbers[6])
    assert (twist.linear.x, twist.angular.z) == (numbers[43], numbers[48])
    assert np.array_equal(message.pose.covariance, fields.pose_covariance)
    assert np.array_equal(message.twist.covariance, fields.twist_covariance)
    assert bytes(store.serialize_cdr(message, 'nav_msgs/msg/Odometry')) == data


@pytest.mark.parametrize('frame', ['', 'g', 'ba', 'gps', 'base_link'])
def test_fix_is_what_rosbags_reads_and_writes(store, frame):
    fields = NavSatFixFields(
        1_000_001, frame, -1, 15, 47.25, -122.5, 1e3, RNG.normal(size=9), 3)
    data = cdr.fix_cdr(fields)
    message = store.deserialize_cdr(data, 'sensor_msgs/msg/NavSatFix')
    assert (message.status.status, message.status.service) == (-1, 15)
    assert (message.latitude, message.longitude, message.altitude) == (47.25, -122.5, 1e3)
    assert np.array_equal(message.position_covariance, fields.position_covariance)
    assert bytes(store.serialize_cdr(message, 'sensor_msgs/msg/NavSatFix')) == data
