"""The state that is given out: output, biases and the covariances of pose and velocity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel

Array = NDArray[np.float64]
SIZE = 67
"""Numbers of one state."""

QUATERNION, VELOCITY, POSITION = slice(0, 4), slice(4, 7), slice(7, 10)
RATE, ACCELERATION = slice(10, 13), slice(13, 16)
GYRO_BIAS, ACCEL_BIAS = slice(16, 19), slice(19, 22)
POSE_COVARIANCE, VELOCITY_COVARIANCE = slice(22, 58), slice(58, 67)
"""Where they are in a row; the covariances row by row."""


@kernel
def attitude_error_jacobian(q: Array) -> Array:
    """Return d(small earth-frame rotation)/d(quaternion), (3, 4): 2 [-v, w I - [v x]]."""
    w, x, y, z = 2.0 * q[0], 2.0 * q[1], 2.0 * q[2], 2.0 * q[3]
    jacobian = np.empty((3, 4))
    jacobian[0, 0], jacobian[0, 1], jacobian[0, 2], jacobian[0, 3] = -x, w, -z, y
    jacobian[1, 0], jacobian[1, 1], jacobian[1, 2], jacobian[1, 3] = -y, z, w, -x
    jacobian[2, 0], jacobian[2, 1], jacobian[2, 2], jacobian[2, 3] = -z, -y, x, w
    return jacobian


@kernel
def fill_pose_covariance(x: Array, p: Array, covariance: Array) -> None:
    """Write that of position NED, then rotations about earth axes, into covariance (6, 6)."""
    jacobian = attitude_error_jacobian(x)
    turned = np.empty(4)
    for i in range(3):
        a, b, c, d = jacobian[i]
        for j in range(3):
            covariance[i, j] = p[7 + i, 7 + j]
            shared = a * p[0, 7 + j] + b * p[1, 7 + j] + c * p[2, 7 + j] + d * p[3, 7 + j]
            covariance[3 + i, j] = covariance[j, 3 + i] = shared
        for j in range(4):
            turned[j] = a * p[0, j] + b * p[1, j] + c * p[2, j] + d * p[3, j]
        for j in range(3):
            covariance[3 + i, 3 + j] = (
                turned[0] * jacobian[j, 0] + turned[1] * jacobian[j, 1]
                + turned[2] * jacobian[j, 2] + turned[3] * jacobian[j, 3])


@kernel
def navigation(
    output: NDArray[np.void], x: Array, p: Array, dt_avg: float, row: Array,
) -> None:
    """Fill row (SIZE,) with what a NavState holds of one OUTPUT and of states and covariance.

    quaternion, velocity and position (10), angular rate (3), acceleration (3), gyro and
    accelerometer biases (6), covariances of pose (36) and velocity (9).
    """
    s = output[0]
    row[0:10] = s['now']
    row[13:16] = s['acceleration']
    row[16:22] = x[10:16] / dt_avg
    row[10:13] = s['rate'] - row[16:19]
    fill_pose_covariance(x, p, row[22:58].reshape(6, 6))
    row[58:67].reshape(3, 3)[:] = p[4:7, 4:7]
