"""A pose that an operator gives: the state jumps to it, with the uncertainty that goes with it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.state import PD
from ekf_fusion_ros.ekf2.state import PN
from ekf_fusion_ros.ekf2.state import VN
from ekf_fusion_ros.estimator import YAW_KNOWN_VARIANCE
from ekf_fusion_ros.estimator import GivenPose
from ekf_fusion_ros.kernels.navigation import attitude_error_jacobian
from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import yaw_of

Array = NDArray[np.float64]


def take_pose(f: Filter, resets: Resets, pose: GivenPose) -> None:
    """Move the predicted state to the given components of a pose and the delayed one along."""
    if pose.yaw_var > 0.0:
        _turn_to(f, resets, pose.yaw, pose.yaw_var)
    now = f.output.now
    lever = matrix_from_quat(now[0:4]) @ np.asarray(f.params.imu.position)
    target = f.x[PN:PD + 1] + (pose.position + lever - now[PN:PD + 1])
    if pose.position_var[0] > 0.0 and pose.position_var[1] > 0.0:
        resets.horizontal_position(target[0:2], pose.position_var[0:2])
        f.last_known_position = f.x[PN:PN + 2].copy()
        f.times.hor_pos = f.t_now
    if pose.position_var[2] > 0.0:
        resets.vertical_position(float(target[2]), float(pose.position_var[2]))
        f.times.hgt = f.t_now
    f.events.add(f.t_now, EventKind.POSE_SET)


def _turn_to(f: Filter, resets: Resets, yaw: float, variance: float) -> None:
    """Turn attitude and velocity about the vertical so that the predicted yaw is the given one."""
    turn = wrap_pi(yaw - yaw_of(matrix_from_quat(f.output.now[0:4])))
    tilt = _rotation_covariance(f)
    resets.yaw(wrap_pi(yaw_of(f.rot) + turn), 0.0)
    _set_rotation_covariance(f, tilt, turn, variance)
    c, s = math.cos(turn), math.sin(turn)
    level = np.array(((c, -s), (s, c)))
    spread = level @ f.cov.p[VN:VN + 2, VN:VN + 2] @ level.T
    resets.horizontal_velocity(level @ f.x[VN:VN + 2], np.diag(spread).copy())
    if f.flags.tilt_align and variance < YAW_KNOWN_VARIANCE:
        f.flags.yaw_align = True


def _rotation_covariance(f: Filter) -> Array:
    """Return the covariance (3, 3) of small rotations about the earth axes, rad^2."""
    jacobian = attitude_error_jacobian(f.x[0:4])
    covariance: Array = jacobian @ f.cov.p[0:4, 0:4] @ jacobian.T
    return covariance


def _set_rotation_covariance(f: Filter, before: Array, turn: float, yaw_var: float) -> None:
    """Give the attitude the tilt covariance it had before a turn, and a variance of yaw.

    For a small rotation r about the earth axes dq = J' r / 4 with J = dr/dq.
    """
    c, s = math.cos(turn), math.sin(turn)
    level = np.array(((c, -s), (s, c)))
    covariance = np.zeros((3, 3))
    covariance[0:2, 0:2] = level @ before[0:2, 0:2] @ level.T
    covariance[2, 2] = yaw_var
    inverse = 0.25 * attitude_error_jacobian(f.x[0:4]).T
    f.cov.set_block(0, inverse @ covariance @ inverse.T)
