"""geometry_msgs/PoseWithCovarianceStamped to the pose that an operator gives."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ekf_fusion_ros import frames
from ekf_fusion_ros.estimator import GivenPose
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import yaw_321
from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.flat import elements
from ekf_fusion_ros.messages.flat import xyz
from ekf_fusion_ros.messages.flat import xyzw
from ekf_fusion_ros.messages.refusal import Refused

MAX_POSITION = 1e6
YAW = 35
USED = (0, 7, 14, YAW)
"""Places of the variances of x, y, z and yaw in the covariance."""


def decode_pose(message: Any, frame: str) -> GivenPose:
    """Return a pose in the frame of that name, ENU/FLU, as one in NED/FRD.

    A message without a frame name is taken to be in it. Variances of 0 mean that a component is
    not given: x and y (together), z, yaw. Raises Refused.
    """
    name = message.header.frame_id
    if name not in ('', frame):
        raise Refused('wrong_frame', f'the pose is in frame {name!r}: give it in {frame!r}')
    covariance = elements(message.pose.covariance, 36, 'pose.covariance')
    fields.check_variances(covariance, USED, 'pose.covariance')
    x_var, y_var, z_var, yaw_var = (float(covariance[index]) for index in USED)
    if not math.isfinite(x_var + y_var + z_var + yaw_var):
        raise Refused('not_finite', 'a variance is infinite: give 0 for what is not known')
    if not ((x_var and y_var) or z_var or yaw_var):
        raise Refused('not_given', 'all variances are 0: give the variance of what is to be set '
                      '(x and y, z, yaw)')
    position = xyz(message.pose.pose.position)
    fields.check_vector(position, 'pose.pose.position', MAX_POSITION)
    yaw = 0.0
    if yaw_var:
        attitude = fields.unit_quaternion(
            xyzw(message.pose.pose.orientation), 'pose.pose.orientation')
        yaw = frames.swap_yaw_enu_ned(yaw_321(matrix_from_quat(attitude)))
    return GivenPose(frames.swap_enu_ned(np.array(position)), np.array((y_var, x_var, z_var)),
                     yaw, yaw_var)
