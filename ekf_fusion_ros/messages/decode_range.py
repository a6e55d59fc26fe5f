"""sensor_msgs/Range to RangeSample, by REP-117."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.flat import FlatMessage
from ekf_fusion_ros.messages.flat import flat_message
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import checked_stamp
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.params.messages import RangeMessageParams
from ekf_fusion_ros.samples import RangeSample

NO_DISTANCE = 0
UNKNOWN_QUALITY = -1
ULTRASOUND = 0
# Places in the flat message; the variance is younger than ROS 2 Humble.
KIND, LIMITS, DISTANCE, VARIANCE = 0, slice(2, 4), 4, 5


def decode_range(message: Any, params: MessageParams) -> RangeSample:
    """Return a Range as a slant distance with the limits of its sensor.

    By REP-117 -inf is an object too close and +inf none within reach: the sensor works but has
    no distance, so the sample stands at that limit with quality 0. NaN is a reading gone wrong.
    A finite distance beyond the limits is left to the estimator, which knows the limits too.
    Ultrasound is marked (`radiation_type`), infrared and laser are not. Raises Refused.
    """
    flat = message if isinstance(message, FlatMessage) else _flat(message)
    time_us = checked_stamp(flat.sec, flat.nanosec)
    low, high = _limits(flat.numbers[LIMITS], params.range)
    distance = float(flat.numbers[DISTANCE])
    variance = _variance(flat.numbers)
    ultrasound = int(flat.numbers[KIND]) == ULTRASOUND
    if math.isinf(distance):
        return RangeSample(time_us, high if distance > 0.0 else low, NO_DISTANCE, low, high,
                           variance, ultrasound)
    fields.check_finite((distance,), 'range')
    if distance < 0.0:
        raise Refused('negative_range', f'range is {distance:g} m: too close is -inf by REP-117')
    return RangeSample(time_us, distance, UNKNOWN_QUALITY, low, high, variance, ultrasound)


def _variance(numbers: Sequence[float]) -> float:
    """Return the variance in m^2; 0, unknown, where it is infinite or the message has none."""
    told = (*numbers[VARIANCE:], 0.0)
    fields.check_variances(told, (0,), 'variance')
    return 0.0 if math.isinf(told[0]) else float(told[0])


def _limits(told: Sequence[float], params: RangeMessageParams) -> tuple[float, float]:
    low, high = params.min_range or float(told[0]), params.max_range or float(told[1])
    if not 0.0 <= low < high < math.inf:
        raise Refused(
            'bad_limits', f'the sensor measures from {low:g} to {high:g} m: min_range and '
            'max_range must say, or messages.range.min_range and max_range')
    return low, high


def _flat(message: Any) -> FlatMessage:
    return flat_message(message, (
        message.radiation_type, message.field_of_view, message.min_range, message.max_range,
        message.range, getattr(message, 'variance', 0.0)))
