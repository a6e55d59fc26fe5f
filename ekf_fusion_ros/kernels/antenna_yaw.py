"""Heading of a pair of GNSS antennas fixed in the body."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel

Array = NDArray[np.float64]

SINGULAR = 1e-3


@kernel
def antenna_gradient(q: Array, offset: float, h: Array) -> bool:
    """Fill h (24,) with d(atan2(e, n))/d(q) of the axis at `offset` rad from body x towards y.

    n = (q0^2 + q1^2 - q2^2 - q3^2) c + 2 (q1 q2 - q0 q3) s,
    e = 2 (q1 q2 + q0 q3) c + (q0^2 - q1^2 + q2^2 - q3^2) s. False where n vanishes.
    """
    q0, q1, q2, q3 = q[0], q[1], q[2], q[3]
    c, s = math.cos(offset), math.sin(offset)
    north = (q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3) * c + 2.0 * (q1 * q2 - q0 * q3) * s
    east = 2.0 * (q1 * q2 + q0 * q3) * c + (q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3) * s
    h[:] = 0.0
    if abs(north) < SINGULAR:
        return False
    scale = 2.0 / (north * north + east * east)
    h[0] = scale * (north * (q3 * c + q0 * s) - east * (q0 * c - q3 * s))
    h[1] = scale * (north * (q2 * c - q1 * s) - east * (q1 * c + q2 * s))
    h[2] = scale * (north * (q1 * c + q2 * s) - east * (-q2 * c + q1 * s))
    h[3] = scale * (north * (q0 * c - q3 * s) - east * (-q3 * c - q0 * s))
    return True
