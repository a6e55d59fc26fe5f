"""Airspeed as linear.x of a twist to readings; what density makes of them is decided later."""

from __future__ import annotations

from typing import Any
from typing import NamedTuple

from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.decode_fix import LINEAR
from ekf_fusion_ros.messages.decode_fix import TWIST_COVARIANCE
from ekf_fusion_ros.messages.decode_fix import flat_twist
from ekf_fusion_ros.messages.flat import FlatMessage
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import checked_stamp
from ekf_fusion_ros.params.messages import MessageParams

UNMEASURED_VARIANCE = 9e4


class AirspeedReading(NamedTuple):
    """Airspeed in m/s, equivalent or true as `messages.airspeed.kind` says."""

    time_us: int
    speed: float


def decode_airspeed(message: Any, params: MessageParams) -> AirspeedReading:
    """Return linear.x of a TwistStamped or TwistWithCovarianceStamped as an airspeed.

    A pitot tube only measures what comes from the front: less than nothing is its noise and
    becomes 0. Raises Refused.
    """
    flat = message if isinstance(message, FlatMessage) else flat_twist(message)
    time_us = checked_stamp(flat.sec, flat.nanosec)
    covariance = flat.numbers[TWIST_COVARIANCE]
    speed, limit = float(flat.numbers[LINEAR][0]), params.airspeed.max_airspeed
    fields.check_finite((speed,), 'twist.linear.x')
    if abs(speed) > limit:
        raise Refused('out_of_range', f'twist.linear.x is {speed:g} m/s: beyond {limit:g}')
    if covariance:
        fields.check_variances(covariance, (0,), 'twist.covariance')
        if covariance[0] >= UNMEASURED_VARIANCE:
            raise Refused('not_measured', 'twist.covariance[0] says that linear.x was not '
                          f'measured: {covariance[0]:g}')
    return AirspeedReading(time_us, max(speed, 0.0))
