"""The pose of the body in the frame of an Odometry message, as the message has it: ENU/FLU."""

from __future__ import annotations

from typing import Any

import numpy as np

from ekf_fusion_ros import frames
from ekf_fusion_ros.mathlib.rigid import Pose
from ekf_fusion_ros.mathlib.rigid import compose
from ekf_fusion_ros.mathlib.rigid import inverse
from ekf_fusion_ros.mathlib.rotation import matrix_from_euler_321
from ekf_fusion_ros.mathlib.rotation import quat_from_matrix
from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.flat import xyz
from ekf_fusion_ros.messages.flat import xyzw
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import checked_stamp
from ekf_fusion_ros.params.messages import OdometryMessageParams

MAX_POSITION = 1e8


def odometry_pose(message: Any, frame: str, params: OdometryMessageParams) -> tuple[int, Pose]:
    """Return stamp in us and odom -> base_link of an Odometry in the frame of that name.

    The mounting of the odometry sensor is taken off. A message without a frame name is taken to
    be in the frame. Raises Refused.
    """
    name = message.header.frame_id.lstrip('/')
    if name not in ('', frame):
        raise Refused('wrong_frame', f'the odometry is in frame {name!r}: set node.odom_frame to '
                      'that name')
    if frames.frame_kind(name) != 'enu' or frames.frame_kind(message.child_frame_id) != 'enu':
        raise Refused('wrong_frame', f'the odometry frames {name!r} and '
                      f'{message.child_frame_id!r} are not ENU/FLU, as TF needs')
    stamp = message.header.stamp
    time_us = checked_stamp(stamp.sec, stamp.nanosec)
    position = xyz(message.pose.pose.position)
    fields.check_vector(position, 'pose.pose.position', MAX_POSITION)
    turn = fields.unit_quaternion(xyzw(message.pose.pose.orientation), 'pose.pose.orientation')
    mount = Pose(np.array(params.mount_xyz),
                 quat_from_matrix(matrix_from_euler_321(*params.mount_rpy)))
    return time_us, compose(Pose(np.array(position), turn), inverse(mount))
