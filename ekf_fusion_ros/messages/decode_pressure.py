"""sensor_msgs/FluidPressure to BaroSample."""

from __future__ import annotations

import math
from typing import Any

from ekf_fusion_ros.geo.atmosphere import pressure_altitude
from ekf_fusion_ros.messages.flat import FlatMessage
from ekf_fusion_ros.messages.flat import FlatRows
from ekf_fusion_ros.messages.flat import flat_message
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import checked_stamp
from ekf_fusion_ros.messages.stamps import plain_stamps
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import BaroSample


def decode_pressure(message: Any, params: MessageParams) -> BaroSample:
    """Return a FluidPressure (Pa) as pressure altitude. Raises Refused."""
    flat = message if isinstance(message, FlatMessage) else _flat(message)
    time_us = checked_stamp(flat.sec, flat.nanosec)
    limits = params.pressure
    pressure = flat.numbers[0]
    if not math.isfinite(pressure):
        raise Refused('not_finite', f'fluid_pressure is {pressure}: not finite')
    if not limits.min_pressure <= pressure <= limits.max_pressure:
        raise Refused(
            'out_of_range',
            f'fluid_pressure is {pressure:g}: not the pressure of air in Pa (hPa or mbar?)')
    return BaroSample(time_us, pressure_altitude(float(pressure)))


def decode_pressure_rows(rows: FlatRows, params: MessageParams) -> list[BaroSample | None]:
    """Return FluidPressure messages as samples, None for each that decode_pressure judges.

    The numbers are the same.
    """
    limits, pressures = params.pressure, rows.numbers[:, 0]
    times, good = plain_stamps(rows.sec, rows.nanosec)
    good &= (limits.min_pressure <= pressures) & (pressures <= limits.max_pressure)
    return [BaroSample(time_us, pressure_altitude(pressure)) if plain else None
            for plain, time_us, pressure in zip(
                good.tolist(), times.tolist(), pressures.tolist(), strict=True)]


def _flat(message: Any) -> FlatMessage:
    return flat_message(message, (message.fluid_pressure, message.variance))
