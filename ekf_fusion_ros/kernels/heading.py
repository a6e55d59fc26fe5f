"""Yaw of an attitude, its Jacobian, and the heading of a levelled magnetic field.

Yaw is taken from the Euler sequence that is farther from its singularity: 321 (yaw, pitch, roll)
where |R31| < |R32|, else 312 (yaw, roll, pitch).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat

Array = NDArray[np.float64]

SINGULAR = 1e-6


@kernel
def refresh_yaw(q: Array, rot: Array) -> float:
    """Write R(q) into rot (3, 3) and return its yaw in rad."""
    rot[:, :] = matrix_from_quat(q)
    if abs(rot[2, 0]) < abs(rot[2, 1]):
        return math.atan2(rot[1, 0], rot[0, 0])
    return math.atan2(-rot[0, 1], rot[1, 1])


@kernel
def yaw_gradient(q: Array, sequence_321: bool, jacobian: Array) -> bool:
    """Fill jacobian (4,) with d(yaw)/d(q) of yaw = atan2(y, x); False at the singularity.

    321: y = 2(q0 q3 + q1 q2), x = q0^2 + q1^2 - q2^2 - q3^2.
    312: y = 2(q0 q3 - q1 q2), x = q0^2 - q1^2 + q2^2 - q3^2.
    """
    q0, q1, q2, q3 = q[0], q[1], q[2], q[3]
    sign = 1.0 if sequence_321 else -1.0
    y = 2.0 * (q0 * q3 + sign * q1 * q2)
    x = q0 * q0 - q3 * q3 + sign * (q1 * q1 - q2 * q2)
    if x * x <= SINGULAR and y * y <= SINGULAR:
        return False
    scale = 2.0 / (x * x + y * y)
    jacobian[0] = scale * (x * q3 - y * q0)
    jacobian[1] = scale * sign * (x * q2 - y * q1)
    jacobian[2] = scale * sign * (x * q1 + y * q2)
    jacobian[3] = scale * (x * q0 + y * q3)
    return True


@kernel
def observe_yaw(q: Array, rot: Array, p: Array, jacobian: Array, gain: Array) -> float:
    """Fill jacobian (4,) and P H' (24,); return H P H' in rad^2, NaN at the singularity."""
    if not yaw_gradient(q, abs(rot[2, 0]) < abs(rot[2, 1]), jacobian):
        return math.nan
    for i in range(24):
        gain[i] = (p[i, 0] * jacobian[0] + p[i, 1] * jacobian[1] + p[i, 2] * jacobian[2]
                   + p[i, 3] * jacobian[3])
    return float(jacobian[0] * gain[0] + jacobian[1] * gain[1] + jacobian[2] * gain[2]
                 + jacobian[3] * gain[3])


@kernel
def level_heading(rot: Array, field: Array) -> float:
    """Return the yaw in rad at which a body field (3,) would point to magnetic north.

    The field is levelled by the tilt of rot, with yaw taken out of the better Euler sequence.
    """
    if abs(rot[2, 0]) < abs(rot[2, 1]):
        yaw = math.atan2(rot[1, 0], rot[0, 0])
    else:
        yaw = math.atan2(-rot[0, 1], rot[1, 1])
    north = rot[0, 0] * field[0] + rot[0, 1] * field[1] + rot[0, 2] * field[2]
    east = rot[1, 0] * field[0] + rot[1, 1] * field[1] + rot[1, 2] * field[2]
    c, s = math.cos(yaw), math.sin(yaw)
    return -math.atan2(c * east - s * north, c * north + s * east)
