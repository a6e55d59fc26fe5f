"""A velocity of the earth frame seen in body axes, and its Jacobian.

With q = (w, u) and the homogeneous R(q), quadratic in q (Sola 2017, eq. 115, transposed):
    R' v = (w^2 - u.u) v + 2 u (u.v) - 2 w (u x v).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel

Array = NDArray[np.float64]


@kernel
def body_velocity(q: Array, velocity: Array, body: Array, jacobian: Array) -> None:
    """Fill body (3,) with R(q)' v and jacobian (3, 7) with its gradient by q and v (3,), m/s."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    a, b, c = velocity[0], velocity[1], velocity[2]
    uv = x * a + y * b + z * c
    cx, cy, cz = y * c - z * b, z * a - x * c, x * b - y * a
    jacobian[0, 0] = 2.0 * (w * a - cx)
    jacobian[1, 0] = 2.0 * (w * b - cy)
    jacobian[2, 0] = 2.0 * (w * c - cz)
    jacobian[0, 1] = 2.0 * uv
    jacobian[1, 1] = 2.0 * (y * a - x * b + w * c)
    jacobian[2, 1] = 2.0 * (z * a - x * c - w * b)
    jacobian[0, 2] = 2.0 * (x * b - y * a - w * c)
    jacobian[1, 2] = 2.0 * uv
    jacobian[2, 2] = 2.0 * (z * b - y * c + w * a)
    jacobian[0, 3] = 2.0 * (x * c - z * a + w * b)
    jacobian[1, 3] = 2.0 * (y * c - z * b - w * a)
    jacobian[2, 3] = 2.0 * uv
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    jacobian[0, 4] = ww + xx - yy - zz
    jacobian[0, 5] = 2.0 * (x * y + w * z)
    jacobian[0, 6] = 2.0 * (x * z - w * y)
    jacobian[1, 4] = 2.0 * (x * y - w * z)
    jacobian[1, 5] = ww - xx + yy - zz
    jacobian[1, 6] = 2.0 * (y * z + w * x)
    jacobian[2, 4] = 2.0 * (x * z + w * y)
    jacobian[2, 5] = 2.0 * (y * z - w * x)
    jacobian[2, 6] = ww - xx - yy + zz
    for i in range(3):
        body[i] = jacobian[i, 4] * a + jacobian[i, 5] * b + jacobian[i, 6] * c
