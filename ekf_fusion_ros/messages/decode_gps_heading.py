"""Heading of a receiver with two antennas, told as a pose or an orientation, to readings."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any
from typing import NamedTuple

from ekf_fusion_ros import frames
from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.flat import FlatMessage
from ekf_fusion_ros.messages.flat import elements
from ekf_fusion_ros.messages.flat import flat_message
from ekf_fusion_ros.messages.flat import xyz
from ekf_fusion_ros.messages.flat import xyzw
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import checked_stamp
from ekf_fusion_ros.params.messages import MessageParams

ABSENT = -1.0
# Places in the flat message of a pose, with or without covariance, and of an Imu.
POSE_LENGTHS = (7, 43)
POSE_ORIENTATION, POSE_COVARIANCE = slice(3, 7), slice(7, 43)
IMU_ORIENTATION, IMU_COVARIANCE = slice(0, 4), slice(4, 13)
POSE_YAW, IMU_YAW = 35, 8
# As good as any direction: the variance of an angle that may be anything is pi^2 / 3.
UNMEASURED_VARIANCE = math.pi ** 2 / 3.0
STEEP = 0.1


class FixHeading(NamedTuple):
    """Heading of the vehicle by a receiver with two antennas.

    yaw rad from north, clockwise; offset rad of the axis through the antennas from body forward,
    clockwise; accuracy 1-sigma rad.
    """

    time_us: int
    yaw: float
    offset: float
    accuracy: float


def decode_gps_heading(message: Any, params: MessageParams) -> FixHeading:
    """Return the yaw of a PoseWithCovarianceStamped, PoseStamped or Imu as a heading.

    The orientation is against ENU unless the frame name ends in _ned or _frd; roll and pitch,
    which two antennas do not measure, do not count. Raises Refused.
    """
    heading = params.gps_heading
    flat = message if isinstance(message, FlatMessage) else _flat(message)
    time_us = checked_stamp(flat.sec, flat.nanosec)
    orientation, variance = _measured(flat.numbers)
    yaw = _yaw(orientation)
    if frames.frame_kind(flat.frame_id) == 'enu':
        yaw = frames.swap_yaw_enu_ned(yaw)
    offset = -heading.antenna_yaw
    if heading.heading_of == 'antennas':
        yaw = wrap_pi(yaw - offset)
    accuracy = math.sqrt(variance) or heading.default_accuracy
    return FixHeading(time_us, yaw, offset, max(accuracy, heading.min_accuracy))


def _measured(numbers: Sequence[float]) -> tuple[Sequence[float], float]:
    """Return the orientation x, y, z, w and the variance of its yaw, 0 where that is not told."""
    if len(numbers) in POSE_LENGTHS:
        covariance = numbers[POSE_COVARIANCE]
        variance = _variance(covariance, POSE_YAW, 'pose.covariance') if covariance else 0.0
        return numbers[POSE_ORIENTATION], variance
    covariance = numbers[IMU_COVARIANCE]
    if covariance[0] == ABSENT:
        raise Refused('no_orientation', 'orientation_covariance[0] is -1: the message carries no '
                      'orientation')
    return numbers[IMU_ORIENTATION], _variance(covariance, IMU_YAW, 'orientation_covariance')


def _variance(covariance: Sequence[float], index: int, name: str) -> float:
    fields.check_variances(covariance, (index,), name)
    variance = float(covariance[index])
    if variance >= UNMEASURED_VARIANCE:
        raise Refused('not_measured', f'{name}[{index}] is {variance:g} rad^2: no heading')
    return variance


def _yaw(orientation: Sequence[float]) -> float:
    w, x, y, z = fields.unit_quaternion(orientation, 'orientation').tolist()
    ahead, aside = 1.0 - 2.0 * (y * y + z * z), 2.0 * (w * z + x * y)
    if math.hypot(ahead, aside) < STEEP:
        raise Refused('steep', 'the orientation points up or down: it has no heading')
    return math.atan2(aside, ahead)


def _flat(message: Any) -> FlatMessage:
    if hasattr(message, 'orientation_covariance'):
        covariance = elements(message.orientation_covariance, 9, 'orientation_covariance')
        return flat_message(message, [*xyzw(message.orientation), *covariance])
    if not hasattr(message.pose, 'covariance'):
        return flat_message(message, _pose(message.pose))
    return flat_message(message, [
        *_pose(message.pose.pose), *elements(message.pose.covariance, 36, 'pose.covariance')])


def _pose(pose: Any) -> list[float]:
    return [*xyz(pose.position), *xyzw(pose.orientation)]
