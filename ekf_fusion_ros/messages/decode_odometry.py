"""nav_msgs/Odometry to VisionSample, converted as MAVROS and PX4 do."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros import frames
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.flat import FlatMessage
from ekf_fusion_ros.messages.flat import elements
from ekf_fusion_ros.messages.flat import flat_message
from ekf_fusion_ros.messages.flat import xyz
from ekf_fusion_ros.messages.flat import xyzw
from ekf_fusion_ros.messages.mounting import body_to_sensor_quaternion
from ekf_fusion_ros.messages.mounting import sensor_to_body
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import checked_stamp
from ekf_fusion_ros.params.messages import ZERO
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.params.messages import OdometryMessageParams
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import NAN4
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]

# Places in the flat message; the twist is linear and angular velocity.
POSITION, ORIENTATION, POSE_COVARIANCE = slice(0, 3), slice(3, 7), slice(7, 43)
LINEAR, TWIST, TWIST_COVARIANCE = slice(43, 46), slice(43, 49), slice(49, 85)

MAX_POSITION = 1e8
MAX_VELOCITY = 1e3

POSITION_PRIMARY = (True, True, False)
VELOCITY_PRIMARY = (True, False, False)
ALL_AXES = (True, True, True)
ROTATION_PRIMARY = (False, False, True)


def decode_odometry(message: Any, params: MessageParams) -> VisionSample:
    """Return an Odometry message as a sample in NED/FRD, velocity in the body frame (FRD).

    The twist is in the child frame, or where `twist_frame` is parent in that of the header.
    Not measured are: the whole position when x or y is not, height (NaN z) alone; the
    orientation when yaw is not; the velocity when the sensor's x axis is not, and when the whole
    twist is zero with zero covariance, as many visual odometries leave it. An orientation
    whose roll or pitch is not measured keeps its yaw and is level. A body velocity axis that is
    not measured beside a measured x is 0 with `lateral_velocity_noise`. Raises Refused.
    """
    odometry = params.odometry
    flat = message if isinstance(message, FlatMessage) else _flat(message)
    time_us = checked_stamp(flat.sec, flat.nanosec)
    kind = parent_kind(flat.frame_id, odometry)
    pose_cov = flat.numbers[POSE_COVARIANCE]
    fields.check_covariance(pose_cov, 'pose.covariance')
    position, position_var = _position(flat, pose_cov, kind, odometry)
    quaternion, angular_var = _orientation(flat, pose_cov, kind, odometry)
    if odometry.twist_frame == 'child':
        velocity, velocity_cov = _velocity(flat, odometry)
    else:
        velocity, velocity_cov = _velocity_of_parent(flat, kind, quaternion, odometry)
    if math.isnan(position[0]) and math.isnan(quaternion[0]) and math.isnan(velocity[0]):
        raise Refused(
            'not_measured', 'all variances say that nothing was measured: neither position nor '
            f'orientation nor velocity is below {odometry.unmeasured_variance:g}')
    return VisionSample(
        time_us, position, quaternion, velocity, position_var, velocity_cov, angular_var,
        VelocityFrame.BODY_FRD)


def parent_kind(frame_id: str, params: OdometryMessageParams) -> str:
    """Return 'enu', 'ned' or 'frd' for the parent frame.

    Raises Refused 'frame_contradiction' when the name does not agree with the configured frame.
    """
    kind = frames.frame_kind(frame_id)
    if params.frame not in ('auto', kind):
        meaning = 'ENU/FLU' if kind == 'enu' else kind.upper()
        raise Refused(
            'frame_contradiction',
            f'header.frame_id {frame_id!r} means {meaning}, but messages.odometry.frame is '
            f'{params.frame}: rename the frame (suffix _ned or _frd) or change the parameter')
    return kind


def has_true_heading(params: OdometryMessageParams) -> bool:
    """True where the odometry frame is declared to be aligned with true north."""
    return params.true_heading or params.frame == 'ned'


def _flat(message: Any) -> FlatMessage:
    pose, twist = message.pose, message.twist
    return flat_message(message, (
        *xyz(pose.pose.position), *xyzw(pose.pose.orientation),
        *elements(pose.covariance, 36, 'pose.covariance'),
        *xyz(twist.twist.linear), *xyz(twist.twist.angular),
        *elements(twist.covariance, 36, 'twist.covariance')), message.child_frame_id)


def _position(
        flat: FlatMessage, pose_cov: Sequence[float], kind: str,
        params: OdometryMessageParams) -> tuple[Array, Array]:
    covariance, measured = fields.measured_block(
        pose_cov, 0, POSITION_PRIMARY, params.position_noise ** 2, params.unmeasured_variance,
        'pose.covariance')
    if not (measured[0] and measured[1]):
        return NAN3, np.full(3, params.unmeasured_variance)
    position = np.array(fields.measured_vector(
        flat.numbers[POSITION], measured, 'pose.pose.position', MAX_POSITION), np.float64)
    variance = covariance.diagonal().copy()
    if kind == 'enu':
        position = frames.swap_enu_ned(position)
        variance[:2] = variance[1], variance[0]
    if not measured[2]:
        position[2] = math.nan
        variance[2] = params.unmeasured_variance
    return position, variance


def _orientation(
        flat: FlatMessage, pose_cov: Sequence[float], kind: str,
        params: OdometryMessageParams) -> tuple[Array, float]:
    covariance, measured = fields.measured_block(
        pose_cov, 3, ROTATION_PRIMARY, params.yaw_noise ** 2, params.unmeasured_variance,
        'pose.covariance')
    if not measured[2]:
        return NAN4, params.unmeasured_variance
    quaternion = fields.unit_quaternion(flat.numbers[ORIENTATION], 'pose.pose.orientation')
    child_is_flu = frames.frame_kind(flat.child_frame_id) == 'enu'
    if kind == 'enu' and child_is_flu:
        quaternion = frames.swap_attitude(quaternion)
    elif kind == 'enu':
        quaternion = frames.swap_attitude_parent(quaternion)
    elif child_is_flu:
        quaternion = frames.swap_attitude_child(quaternion)
    if params.mount_rpy != ZERO:
        quaternion = quat_multiply(quaternion, body_to_sensor_quaternion(params.mount_rpy))
    if not (measured[0] and measured[1]):
        quaternion = _levelled(quaternion)
    return quaternion, float(covariance[2, 2])


def _velocity(flat: FlatMessage, params: OdometryMessageParams) -> tuple[Array, Array]:
    twist_cov = flat.numbers[TWIST_COVARIANCE]
    fields.check_covariance(twist_cov, 'twist.covariance')
    covariance, measured = fields.measured_block(
        twist_cov, 0, VELOCITY_PRIMARY, params.velocity_noise ** 2, params.unmeasured_variance,
        'twist.covariance')
    if not measured[0] or _never_filled_in(flat):
        return NAN3, params.unmeasured_variance * np.eye(3)
    velocity = fields.measured_vector(
        flat.numbers[LINEAR], measured, 'twist.twist.linear', MAX_VELOCITY)
    for axis in (1, 2):
        if not measured[axis]:
            covariance[axis, axis] = params.lateral_velocity_noise ** 2
    rotation = sensor_to_body(params.mount_rpy, flat.child_frame_id)
    return rotation.dot(velocity), frames.rotate_covariance(covariance, rotation)


def _velocity_of_parent(
        flat: FlatMessage, kind: str, quaternion: Array,
        params: OdometryMessageParams) -> tuple[Array, Array]:
    """Turn a velocity along the axes of the parent frame into the body by quaternion (4,)."""
    twist_cov = flat.numbers[TWIST_COVARIANCE]
    fields.check_covariance(twist_cov, 'twist.covariance')
    covariance, measured = fields.measured_block(
        twist_cov, 0, ALL_AXES, params.velocity_noise ** 2, params.unmeasured_variance,
        'twist.covariance')
    level = measured[0] and measured[1]
    if not level or math.isnan(quaternion[0]) or _never_filled_in(flat):
        return NAN3, params.unmeasured_variance * np.eye(3)
    velocity = fields.measured_vector(
        flat.numbers[LINEAR], measured, 'twist.twist.linear', MAX_VELOCITY)
    if not measured[2]:
        covariance[2, 2] = params.unmeasured_variance
    to_body = matrix_from_quat(quaternion).T
    if kind == 'enu':
        to_body = to_body @ frames.NED_ENU
    return to_body.dot(velocity), frames.rotate_covariance(covariance, to_body)


def _never_filled_in(flat: FlatMessage) -> bool:
    """True where the whole twist is zero, with zero covariance."""
    return not (any(flat.numbers[TWIST_COVARIANCE]) or any(flat.numbers[TWIST]))


def _levelled(quaternion: Array) -> Array:
    w, x, y, z = quaternion.tolist()
    half_yaw = 0.5 * math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.array((math.cos(half_yaw), 0.0, 0.0, math.sin(half_yaw)))
