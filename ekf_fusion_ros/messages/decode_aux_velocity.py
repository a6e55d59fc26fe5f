"""Velocity against a target at rest, as of a landing beacon, to samples."""

from __future__ import annotations

from typing import Any

import numpy as np

from ekf_fusion_ros import frames
from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.decode_fix import LINEAR
from ekf_fusion_ros.messages.decode_fix import MAX_VELOCITY
from ekf_fusion_ros.messages.decode_fix import TWIST_COVARIANCE
from ekf_fusion_ros.messages.decode_fix import UNMEASURED_VARIANCE
from ekf_fusion_ros.messages.decode_fix import flat_twist
from ekf_fusion_ros.messages.flat import FlatMessage
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import checked_stamp
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import AuxVelocitySample


def decode_aux_velocity(message: Any, params: MessageParams) -> AuxVelocitySample:
    """Return a TwistStamped or TwistWithCovarianceStamped as a velocity over ground in NED.

    It is the velocity of the vehicle, which is the opposite of what a target seems to have. The
    axes are ENU unless the frame name ends in _ned. A zero variance is unknown, and the vertical
    axis may be unmeasured. Raises Refused.
    """
    flat = message if isinstance(message, FlatMessage) else flat_twist(message)
    time_us = checked_stamp(flat.sec, flat.nanosec)
    covariance = flat.numbers[TWIST_COVARIANCE]
    variance = np.zeros(3)
    if covariance:
        fields.check_variances(covariance, (0, 7, 14), 'twist.covariance')
        variance[:] = covariance[0], covariance[7], covariance[14]
    if max(variance[0:2]) >= UNMEASURED_VARIANCE:
        raise Refused('not_measured', 'twist.covariance says that a horizontal axis was not '
                      f'measured: {max(variance[0:2]):g}')
    has_vertical = variance[2] < UNMEASURED_VARIANCE
    linear = fields.measured_vector(
        flat.numbers[LINEAR], (True, True, bool(has_vertical)), 'twist.linear', MAX_VELOCITY)
    variance[variance == 0.0] = params.aux_velocity.default_noise ** 2
    variance = np.clip(
        variance, params.aux_velocity.min_noise ** 2, UNMEASURED_VARIANCE)
    velocity = np.array(linear, np.float64)
    if frames.frame_kind(flat.frame_id) == 'enu':
        velocity, variance = frames.swap_enu_ned(velocity), np.abs(frames.swap_enu_ned(variance))
    return AuxVelocitySample(time_us, velocity, variance)
