"""odom -> base_link of an Odometry message, as TF has it."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from ekf_fusion_ros.messages.odometry_pose import odometry_pose
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import OdometryMessageParams

HALF = math.sqrt(0.5)


def odometry(
    frame='odom', child='base_link', position=(1.0, 2.0, 3.0), turn=(0.0, 0.0, HALF, HALF), sec=5,
):
    x, y, z = position
    qx, qy, qz, qw = turn
    return SimpleNamespace(
        header=SimpleNamespace(frame_id=frame, stamp=SimpleNamespace(sec=sec, nanosec=0)),
        child_frame_id=child, pose=SimpleNamespace(pose=SimpleNamespace(
            position=SimpleNamespace(x=x, y=y, z=z),
            orientation=SimpleNamespace(x=qx, y=qy, z=qz, w=qw))))


@pytest.mark.parametrize('frame', ['odom', '/odom', ''])
def test_the_pose_is_that_of_the_message(frame):
    time_us, pose = odometry_pose(odometry(frame), 'odom', OdometryMessageParams())
    assert time_us == 5_000_000
    np.testing.assert_allclose(pose.position, (1.0, 2.0, 3.0))
    np.testing.assert_allclose(pose.quaternion, (HALF, 0.0, 0.0, HALF))


def test_the_mounting_is_taken_off():
    """A sensor 0.5 m ahead, turned by 90 deg to the left: the body looks along x, behind it."""
    params = OdometryMessageParams(mount_xyz=(0.5, 0.0, 0.0), mount_rpy=(0.0, 0.0, math.pi / 2))
    _, pose = odometry_pose(odometry(), 'odom', params)
    np.testing.assert_allclose(pose.position, (0.5, 2.0, 3.0), atol=1e-12)
    np.testing.assert_allclose(abs(pose.quaternion[0]), 1.0)


@pytest.mark.parametrize(('message', 'reason'), [
    (odometry('camera_odom'), 'wrong_frame'),
    (odometry(child='base_link_frd'), 'wrong_frame'),
    (odometry(position=(math.nan, 0.0, 0.0)), 'not_finite'),
    (odometry(turn=(0.0, 0.0, 0.0, 0.0)), 'zero_quaternion'),
    (odometry(sec=0), 'zero_stamp'),
])
def test_what_tf_cannot_use_is_refused(message, reason):
    with pytest.raises(Refused) as caught:
        odometry_pose(message, 'odom', OdometryMessageParams())
    assert caught.value.reason == reason
