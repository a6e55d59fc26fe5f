"""Yaw of an attitude, its Jacobian, and the heading of a levelled magnetic field.

Yaw is taken from the Euler sequence that is farther from its singularity: 321 (yaw, pitch, roll)
where |R31| < |R32|, else 312 (yaw, roll, pitch).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.kernels.update import WIND_ACTIVE
from ekf_fusion_ros.kernels.update import apply_update
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat

Array = NDArray[np.float64]

SINGULAR = 1e-6


@kernel
def refresh_yaw(x: Array, rot: Array) -> float:
    """Write R(q) of a state x (24,) into rot (3, 3) and return its yaw in rad."""
    rot[:, :] = matrix_from_quat(x)
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
def observe_yaw(x: Array, rot: Array, p: Array, jacobian: Array, gain: Array) -> float:
    """Fill jacobian (4,) and P H' (24,); return H P H' in rad^2, NaN at the singularity."""
    if not yaw_gradient(x, abs(rot[2, 0]) < abs(rot[2, 1]), jacobian):
        return math.nan
    for i in range(24):
        gain[i] = (p[i, 0] * jacobian[0] + p[i, 1] * jacobian[1] + p[i, 2] * jacobian[2]
                   + p[i, 3] * jacobian[3])
    return float(jacobian[0] * gain[0] + jacobian[1] * gain[1] + jacobian[2] * gain[2]
                 + jacobian[3] * gain[3])


@kernel
def apply_yaw(
    p: Array, x: Array, jacobian: Array, gain: Array, variance: float, innovation: float,
    limits: Array,
) -> bool:
    """Correct with what observe_yaw has found and an innovation variance; False on a fault.

    innovation in rad, variance in rad^2; p (24, 24), x (24,), limits (6,) see kernels.update. The
    gain of the magnetic field is cut, and that of the wind while it is not estimated.
    """
    last = 24 if limits[WIND_ACTIVE] != 0.0 else 22
    for i in range(16):
        gain[i] /= variance
    gain[16:22] = 0.0
    for i in range(22, 24):
        gain[i] = gain[i] / variance if i < last else 0.0
    hp = np.empty(24)
    for i in range(24):
        hp[i] = (jacobian[0] * p[0, i] + jacobian[1] * p[1, i] + jacobian[2] * p[2, i]
                 + jacobian[3] * p[3, i])
    return apply_update(p, x, gain, hp, innovation, limits)


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


@kernel
def compare_headings(x: Array, rot: Array, field: Array) -> tuple[float, float]:
    """Write R(q) of a state x (24,) into rot (3, 3); return its yaw and the magnetic one in rad.

    field (3,) measured in body axes; the body field of the state is taken off.
    """
    return refresh_yaw(x, rot), level_heading(rot, field - x[19:22])
