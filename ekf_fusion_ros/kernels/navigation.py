"""The state that is given out: output, biases and the covariances of pose and velocity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel

Array = NDArray[np.float64]
SIZE = 67
"""Numbers of one state."""


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
def pose_covariance(x: Array, p: Array) -> Array:
    """Return (6, 6) of states and covariance: position NED, then rotations about earth axes."""
    jacobian = attitude_error_jacobian(x)
    covariance = np.empty((6, 6))
    covariance[0:3, 0:3] = p[7:10, 7:10]
    turned = np.dot(jacobian, np.ascontiguousarray(p[0:4, 0:10]))
    covariance[3:6, 0:3] = turned[:, 7:10]
    covariance[0:3, 3:6] = turned[:, 7:10].T
    covariance[3:6, 3:6] = np.dot(np.ascontiguousarray(turned[:, 0:4]), jacobian.T)
    return covariance


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
    row[22:58] = pose_covariance(x, p).ravel()
    for i in range(3):
        row[58 + 3 * i:61 + 3 * i] = p[4 + i, 4:7]
