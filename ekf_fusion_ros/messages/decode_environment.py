"""sensor_msgs/MagneticField and FluidPressure to samples."""

from __future__ import annotations

import math
from typing import Any

from ekf_fusion_ros.geo.atmosphere import pressure_altitude
from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.mounting import sensor_to_body
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import stamp_of
from ekf_fusion_ros.params.messages import MagneticFieldMessageParams
from ekf_fusion_ros.params.messages import PressureMessageParams
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import MagSample

GAUSS_PER_TESLA = 1e4


def decode_magnetic_field(message: Any, params: MagneticFieldMessageParams) -> MagSample:
    """Return a MagneticField (tesla) as Gauss in body FRD. Raises Refused."""
    time_us = stamp_of(message)
    fields.check_variances(
        message.magnetic_field_covariance, (0, 4, 8), 'magnetic_field_covariance')
    tesla = fields.vector(message.magnetic_field, 'magnetic_field (in tesla)', params.max_field)
    if not tesla.any():
        raise Refused('zero_field', 'magnetic_field is all zero: the sensor does not measure')
    rotation = sensor_to_body(params.mount_rpy, message.header.frame_id)
    return MagSample(time_us, GAUSS_PER_TESLA * (rotation @ tesla))


def decode_pressure(message: Any, params: PressureMessageParams) -> BaroSample:
    """Return a FluidPressure (Pa) as pressure altitude. Raises Refused."""
    time_us = stamp_of(message)
    pressure = message.fluid_pressure
    if not math.isfinite(pressure):
        raise Refused('not_finite', f'fluid_pressure is {pressure}: not finite')
    if not params.min_pressure <= pressure <= params.max_pressure:
        raise Refused(
            'out_of_range',
            f'fluid_pressure is {pressure:g}: not the pressure of air in Pa (hPa or mbar?)')
    return BaroSample(time_us, pressure_altitude(float(pressure)))
