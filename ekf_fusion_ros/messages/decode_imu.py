"""sensor_msgs/Imu to readings, and readings to the increments that the estimator takes."""

from __future__ import annotations

from typing import Any
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros import frames
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.mounting import body_to_sensor_quaternion
from ekf_fusion_ros.messages.mounting import sensor_to_body
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import stamp_of
from ekf_fusion_ros.params.messages import ZERO
from ekf_fusion_ros.params.messages import ImuMessageParams
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import ImuSample

Array = NDArray[np.float64]

ABSENT = -1.0


class ImuReading(NamedTuple):
    """Rate (3,) rad/s and specific force (3,) m/s^2 in body FRD at a stamp.

    orientation (4,) w, x, y, z body FRD to NED, None where the message has none.
    """

    time_us: int
    rate: Array
    specific_force: Array
    orientation: Array | None = None


def decode_imu(message: Any, params: MessageParams) -> ImuReading:
    """Return an Imu message as a reading, by REP-145.

    A first covariance element of -1 means that the field is absent, all zero that its noise is
    unknown. An orientation that is not a rotation counts as absent. Raises Refused, also where
    the angular velocity or the acceleration is absent.
    """
    time_us = stamp_of(message)
    _check_present(message.angular_velocity_covariance, 'angular_velocity')
    _check_present(message.linear_acceleration_covariance, 'linear_acceleration')
    rate = fields.vector(message.angular_velocity, 'angular_velocity', params.imu.max_rate)
    force = fields.vector(
        message.linear_acceleration, 'linear_acceleration', params.imu.max_acceleration)
    rotation = sensor_to_body(params.imu.mount_rpy, message.header.frame_id)
    orientation = _orientation(message, params.imu)
    return ImuReading(time_us, rotation.dot(rate), rotation.dot(force), orientation)


class ImuIntegrator:
    """Turns readings into increments: each reading holds over the interval that it ends.

    That is exact for sensors that publish means over their interval, as autopilots do.
    `gaps` counts the intervals above `max_gap`; such a one is not filled with a single reading
    but counts as one ordinary interval.
    """

    def __init__(self, params: MessageParams) -> None:
        """Take `imu.max_gap`, the longest interval that one reading may fill."""
        self._max_gap_us = round(params.imu.max_gap * 1e6)
        self.gaps = 0
        self.reset()

    def reset(self) -> None:
        """Forget the last reading; the count of gaps stays."""
        self._last_us: int | None = None
        self._interval_us = 0

    def push(self, reading: ImuReading) -> ImuSample | None:
        """Return the increments up to this reading, None for the first.

        Raises Refused 'repeated_stamp' or 'backward_stamp' when time does not advance.
        """
        last_us = self._last_us
        if last_us is None:
            self._last_us = reading.time_us
            return None
        step_us = reading.time_us - last_us
        if step_us <= 0:
            reason = 'backward_stamp' if step_us else 'repeated_stamp'
            raise Refused(reason, f'header.stamp is {-step_us} us before the last reading')
        self._last_us = reading.time_us
        if step_us > self._max_gap_us:
            self.gaps += 1
            step_us = self._interval_us or self._max_gap_us
        else:
            self._interval_us = step_us
        dt = step_us * 1e-6
        return ImuSample(reading.time_us, reading.rate * dt, reading.specific_force * dt, dt, dt)


def _check_present(covariance: Any, name: str) -> None:
    if covariance[0] >= 0.0 and covariance[4] >= 0.0 and covariance[8] >= 0.0:
        return
    if covariance[0] == ABSENT:
        raise Refused(
            f'no_{name}', f'{name}_covariance[0] is -1: the message carries no {name}')
    fields.check_variances(covariance, (0, 4, 8), f'{name}_covariance')


def _orientation(message: Any, params: ImuMessageParams) -> Array | None:
    if message.orientation_covariance[0] == ABSENT:
        return None
    try:
        quaternion = fields.unit_quaternion(message.orientation, 'orientation')
    except Refused:
        return None
    if frames.frame_kind(message.header.frame_id) == 'enu':
        quaternion = frames.swap_attitude(quaternion)
    if params.mount_rpy != ZERO:
        quaternion = quat_multiply(quaternion, body_to_sensor_quaternion(params.mount_rpy))
    return quaternion
