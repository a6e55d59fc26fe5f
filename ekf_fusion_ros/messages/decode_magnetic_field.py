"""sensor_msgs/MagneticField to MagSample."""

from __future__ import annotations

from typing import Any

from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.mounting import sensor_to_body
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import stamp_of
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import MagSample

GAUSS_PER_TESLA = 1e4


def decode_magnetic_field(message: Any, params: MessageParams) -> MagSample:
    """Return a MagneticField (tesla) as Gauss in body FRD. Raises Refused."""
    time_us = stamp_of(message)
    fields.check_variances(
        message.magnetic_field_covariance, (0, 4, 8), 'magnetic_field_covariance')
    tesla = fields.vector(
        message.magnetic_field, 'magnetic_field (in tesla)', params.magnetic_field.max_field)
    if not (tesla[0] or tesla[1] or tesla[2]):
        raise Refused('zero_field', 'magnetic_field is all zero: the sensor does not measure')
    rotation = sensor_to_body(params.magnetic_field.mount_rpy, message.header.frame_id)
    return MagSample(time_us, GAUSS_PER_TESLA * rotation.dot(tesla))
