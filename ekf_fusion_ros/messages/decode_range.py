"""sensor_msgs/Range to RangeSample, by REP-117."""

from __future__ import annotations

import math
from typing import Any

from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import stamp_of
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.params.messages import RangeMessageParams
from ekf_fusion_ros.samples import RangeSample

NO_DISTANCE = 0
UNKNOWN_QUALITY = -1


def decode_range(message: Any, params: MessageParams) -> RangeSample:
    """Return a Range as a slant distance with the limits of its sensor.

    By REP-117 -inf is an object too close and +inf none within reach: the sensor works but has
    no distance, so the sample stands at that limit with quality 0. NaN is a reading gone wrong.
    A finite distance beyond the limits is left to the estimator, which knows the limits too.
    Ultrasound and infrared (`radiation_type`) count alike. Raises Refused.
    """
    time_us = stamp_of(message)
    low, high = _limits(message, params.range)
    # The field is younger than ROS 2 Humble.
    fields.check_variances((getattr(message, 'variance', 0.0),), (0,), 'variance')
    distance = float(message.range)
    if math.isinf(distance):
        return RangeSample(time_us, high if distance > 0.0 else low, NO_DISTANCE, low, high)
    fields.check_finite((distance,), 'range')
    if distance < 0.0:
        raise Refused('negative_range', f'range is {distance:g} m: too close is -inf by REP-117')
    return RangeSample(time_us, distance, UNKNOWN_QUALITY, low, high)


def _limits(message: Any, params: RangeMessageParams) -> tuple[float, float]:
    low = params.min_range or float(message.min_range)
    high = params.max_range or float(message.max_range)
    if not 0.0 <= low < high < math.inf:
        raise Refused(
            'bad_limits', f'the sensor measures from {low:g} to {high:g} m: min_range and '
            'max_range must say, or messages.range.min_range and max_range')
    return low, high
