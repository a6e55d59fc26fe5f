"""A complementary attitude filter: gyro, steadied by gravity and by a heading.

Mahony, Hamel and Pflimlin, "Nonlinear complementary filters on the special orthogonal group"
(2008), with the explicit correction of their equation (48); gates and gains as in PX4's
attitude_estimator_q.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.lpe.prediction import GRAVITY
from ekf_fusion_ros.lpe.state import SECOND
from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.mathlib.rotation import cross
from ekf_fusion_ros.mathlib.rotation import matrix_from_euler_321
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import quat_from_matrix
from ekf_fusion_ros.mathlib.rotation import quat_from_rotation_vector
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.mathlib.rotation import quat_normalise
from ekf_fusion_ros.mathlib.rotation import with_yaw
from ekf_fusion_ros.params.lpe import AttitudeParams

Array = NDArray[np.float64]

DOWN = np.array((0.0, 0.0, 1.0))
ZERO = np.zeros(3)
GRAVITY_TOLERANCE = 0.1
"""Share of gravity by which the specific force of a body at rest or in known motion may differ."""

BIAS_RATE_MAX = 0.175
"""rad/s above which the gyro bias is not learned."""

HEADING_AGE_US = SECOND // 2


class AttitudeFilter:
    """Attitude (4,) body to NED with its rotation matrix, and the gyro bias (3,) in rad/s."""

    def __init__(self) -> None:
        """Start without attitude."""
        self.ready = False
        self.yaw_known = False
        self.quaternion = np.array((1.0, 0.0, 0.0, 0.0))
        self.rot = np.eye(3)
        self.gyro_bias = ZERO.copy()
        self._yaw_error = 0.0
        self._yaw_error_us = 0

    def take(self, quaternion: Array) -> None:
        """Take an attitude (4,) of somebody else for its own."""
        self.ready = True
        self.quaternion = quaternion
        self.rot = matrix_from_quat(quaternion)

    def take_yaw(self, yaw: float) -> None:
        """Keep the tilt, turn to a yaw in rad."""
        self.take(quat_from_matrix(with_yaw(self.rot, yaw)))
        self.yaw_known = True
        self._yaw_error = 0.0

    def level(self, force: Array) -> None:
        """Start with the tilt that a specific force (3,) m/s^2 at rest tells, yaw 0."""
        if self._is_gravity(force):
            roll = math.atan2(-force[1], -force[2])
            pitch = math.atan2(force[0], math.hypot(force[1], force[2]))
            self.take(quat_from_matrix(matrix_from_euler_321(roll, pitch, 0.0)))

    def note_heading(self, time_us: int, error: float) -> None:
        """Note what a heading says of the yaw in rad: measured minus ours."""
        self._yaw_error, self._yaw_error_us = wrap_pi(error), time_us

    def turn(self, angle: Array, dt: float) -> None:
        """Turn by an increment (3,) rad of the gyro over dt s, its bias taken off."""
        turned = quat_multiply(
            self.quaternion, quat_from_rotation_vector(angle - self.gyro_bias * dt))
        self.take(quat_normalise(turned))

    def steady(
        self, time_us: int, gravity: Array, rate: Array, dt: float, params: AttitudeParams,
    ) -> None:
        """Turn towards gravity and the last heading over dt s.

        gravity (3,) m/s^2 body as it is measured, rate (3,) rad/s body.
        """
        correction = ZERO
        if self._is_gravity(gravity):
            measured = gravity / np.linalg.norm(gravity)
            correction = params.accel_gain * cross(measured, self.rot.T @ DOWN)
        if time_us - self._yaw_error_us < HEADING_AGE_US:
            correction = correction + self.rot[2] * (params.yaw_gain * self._yaw_error)
        if np.linalg.norm(rate) < BIAS_RATE_MAX:
            limit = params.gyro_bias_limit
            bias = self.gyro_bias - params.gyro_bias_gain * dt * correction
            self.gyro_bias = np.clip(bias, -limit, limit)
        turned = quat_multiply(self.quaternion, quat_from_rotation_vector(correction * dt))
        self.take(quat_normalise(turned))

    @staticmethod
    def _is_gravity(force: Array) -> bool:
        share = float(np.linalg.norm(force)) / float(GRAVITY[2])
        return abs(share - 1.0) < GRAVITY_TOLERANCE
