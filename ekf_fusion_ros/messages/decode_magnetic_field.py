"""sensor_msgs/MagneticField to MagSample."""

from __future__ import annotations

from typing import Any

import numpy as np

from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.flat import FlatMessage
from ekf_fusion_ros.messages.flat import FlatRows
from ekf_fusion_ros.messages.flat import elements
from ekf_fusion_ros.messages.flat import flat_message
from ekf_fusion_ros.messages.flat import where_good
from ekf_fusion_ros.messages.flat import xyz
from ekf_fusion_ros.messages.mounting import turned_to_body
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import checked_stamp
from ekf_fusion_ros.messages.stamps import plain_stamps
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import MagSample

GAUSS_PER_TESLA = 1e4
# Places in the flat message.
FIELD, COVARIANCE = slice(0, 3), slice(3, 12)


def decode_magnetic_field(message: Any, params: MessageParams) -> MagSample:
    """Return a MagneticField (tesla) as Gauss in body FRD. Raises Refused."""
    flat = message if isinstance(message, FlatMessage) else _flat(message)
    time_us = checked_stamp(flat.sec, flat.nanosec)
    tesla = flat.numbers[FIELD]
    fields.check_variances(flat.numbers[COVARIANCE], (0, 4, 8), 'magnetic_field_covariance')
    fields.check_vector(tesla, 'magnetic_field (in tesla)', params.magnetic_field.max_field)
    if not any(tesla):
        raise Refused('zero_field', 'magnetic_field is all zero: the sensor does not measure')
    x, y, z = turned_to_body(tesla, params.magnetic_field.mount_rpy, flat.frame_id)
    return MagSample(time_us, GAUSS_PER_TESLA * np.array((x, y, z)))


def decode_magnetic_field_rows(rows: FlatRows, params: MessageParams) -> list[MagSample | None]:
    """Return MagneticField messages as samples, None for each that decode_magnetic_field judges.

    The numbers are the same.
    """
    limits, columns = params.magnetic_field, rows.numbers.T
    times, good = plain_stamps(rows.sec, rows.nanosec)
    tesla = columns[FIELD]
    good &= (np.abs(tesla) <= limits.max_field).all(axis=0) & tesla.any(axis=0)
    good &= (columns[COVARIANCE][::4] >= 0.0).all(axis=0)
    field = GAUSS_PER_TESLA * np.stack(
        turned_to_body(np.where(good, tesla, 0.0), limits.mount_rpy, rows.frame_id), axis=1)
    return where_good(map(MagSample, times.tolist(), field), good)


def _flat(message: Any) -> FlatMessage:
    covariance = elements(message.magnetic_field_covariance, 9, 'magnetic_field_covariance')
    return flat_message(message, (*xyz(message.magnetic_field), *covariance))
