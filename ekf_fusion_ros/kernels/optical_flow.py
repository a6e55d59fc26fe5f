"""Optical flow about the body axes x and y: the body velocity over the distance to the ground.

rate_x = v_y / r, rate_y = -v_x / r, with r the distance along the camera axis.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.body_velocity import body_velocity
from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.kernels.prediction import NOMINAL_PERIOD

Array = NDArray[np.float64]


@kernel
def flow_jacobians(x: Array, distance: float, h: Array) -> None:
    """Fill h (2, 24) with the gradients of the two rates by attitude and velocity, 1/s.

    distance in m is taken to be known.
    """
    body, jacobian = np.empty(3), np.empty((3, 7))
    body_velocity(x[0:4], x[4:7], body, jacobian)
    h[:, :] = 0.0
    for i in range(7):
        h[0, i] = jacobian[1, i] / distance
        h[1, i] = -jacobian[0, i] / distance


@kernel
def accumulate_motion(imu: Array, x: Array, share: float, turn: Array, motion: Array) -> None:
    """Add imu (8,) of one filter period to what is known of the motion, in place.

    turn (4,): sum of the bias-corrected delta angles in rad and of their intervals in s; motion
    (4,): specific force low-passed by a share of the newest, m/s^2, and the peak of the rate,
    rad/s, that decays by the same share.
    """
    squared = 0.0
    for i in range(3):
        turn[i] += imu[i] - x[10 + i]
        motion[i] += share * (imu[3 + i] / NOMINAL_PERIOD - motion[i])
        squared += imu[i] * imu[i]
    turn[3] += imu[6]
    motion[3] = max(math.sqrt(squared) / NOMINAL_PERIOD, (1.0 - share) * motion[3])
