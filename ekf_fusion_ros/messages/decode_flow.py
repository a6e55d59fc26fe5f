"""Optical flow as a geometry_msgs/Vector3Stamped to readings, and readings to FlowSample.

No standard message carries flow. This one does by agreement: x and y are the rates of the scene
in rad/s, z is the quality from 0 to 1. Signs are those of ECL (Riseborough): in FRD and without
rotation x = +v_right / height and y = -v_forward / height; a rotation of the body at (p, q) adds
(-p, -q). The message has no gyro, so the estimator compensates with the inertial input.
"""

from __future__ import annotations

import math
from typing import Any
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.flat import FlatMessage
from ekf_fusion_ros.messages.flat import flat_message
from ekf_fusion_ros.messages.flat import xyz
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import checked_stamp
from ekf_fusion_ros.params.messages import FlowMessageParams
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import FlowSample

Array = NDArray[np.float64]

BEST_QUALITY = 255


class FlowReading(NamedTuple):
    """Rate of the scene (2,) rad/s about body forward and right (FRD), quality 0..255."""

    time_us: int
    rate: Array
    quality: int


def decode_flow(message: Any, params: MessageParams) -> FlowReading:
    """Return a Vector3Stamped as a reading. Raises Refused."""
    flow = params.flow
    flat = message if isinstance(message, FlatMessage) else _flat(message)
    time_us = checked_stamp(flat.sec, flat.nanosec)
    fields.check_finite(flat.numbers, 'vector')
    x, y, quality = flat.numbers
    if max(abs(x), abs(y)) > flow.max_rate:
        raise Refused('out_of_range', f'vector is ({x:g}, {y:g}) rad/s: beyond {flow.max_rate:g}')
    if not 0.0 <= quality <= 1.0:
        raise Refused('bad_quality', f'vector.z is {quality:g}: the quality, from 0 to 1')
    rate = _body_rate(x, y, _is_frd(flat.frame_id, flow), flow)
    return FlowReading(time_us, rate, round(BEST_QUALITY * quality))


class FlowIntegrator:
    """Turns readings into angles: each reading holds over the interval that it ends."""

    def __init__(self, params: FlowMessageParams) -> None:
        """Take `max_interval`, the longest interval that one reading may fill."""
        self._max_us = round(1e6 * params.max_interval)
        self._last_us: int | None = None
        self._interval_us = self._max_us

    def push(self, reading: FlowReading) -> FlowSample:
        """Return the sample of a reading.

        The first one and one after a long gap count as one interval of those before.
        """
        if self._last_us is not None and 0 < reading.time_us - self._last_us <= self._max_us:
            self._interval_us = reading.time_us - self._last_us
        self._last_us = reading.time_us
        dt = 1e-6 * self._interval_us
        return FlowSample(reading.time_us, dt * reading.rate, NAN3, reading.quality, dt)


def _flat(message: Any) -> FlatMessage:
    return flat_message(message, xyz(message.vector))


def _is_frd(frame_id: str, params: FlowMessageParams) -> bool:
    if params.axes == 'auto':
        return 'frd' in frame_id.split('_')
    return params.axes == 'frd'


def _body_rate(x: float, y: float, frd: bool, params: FlowMessageParams) -> Array:
    sign = 1.0 if params.convention == 'ecl' else -1.0
    left = -y if frd else y
    c, s = math.cos(params.mount_yaw), math.sin(params.mount_yaw)
    return sign * np.array((c * x - s * left, -(s * x + c * left)))
