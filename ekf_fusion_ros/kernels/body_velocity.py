"""A velocity of the earth frame seen in body axes, and its Jacobian.

With q = (w, u) and the homogeneous R(q), quadratic in q (Sola 2017, eq. 115, transposed):
    R' v = (w^2 - u.u) v + 2 u (u.v) - 2 w (u x v).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.kernels.innovation import project
from ekf_fusion_ros.kernels.update import apply_update
from ekf_fusion_ros.kernels.update import test_ratio

Array = NDArray[np.float64]
Three = tuple[float, float, float]


@kernel
def body_velocity(q: Array, velocity: Array, body: Array, jacobian: Array) -> None:
    """Fill body (3,) with R(q)' v and the first seven columns of jacobian with its gradient.

    The gradient is by q and v (3,), m/s; jacobian has three rows.
    """
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


@kernel
def fuse_body_velocity(
    p: Array, x: Array, measured: Array, noise: Array, gate: float, limits: Array,
) -> tuple[Three, Three, Three, int]:
    """Gate and fuse a velocity (3,) in body axes, m/s; noise (3,) variances in (m/s)^2.

    Forward and right are judged together, down by itself; each is fused about the state that the
    axes before have corrected. Returns innovations, variances and test ratios of all from before
    the first, and a word whose bit i tells that the update of axis i was unhealthy.
    """
    body, jacobian, hp = np.empty(3), np.empty((3, 7)), np.empty(24)
    innovation, variance, ratio = np.empty(3), np.empty(3), np.empty(3)
    body_velocity(x, x[4:7], body, jacobian)
    for axis in range(3):
        innovation[axis] = body[axis] - measured[axis]
        variance[axis] = project(p, jacobian[axis], hp) + noise[axis]
        ratio[axis] = test_ratio(innovation[axis], variance[axis], gate)
    faults = 0
    for axis in range(3):
        judged = ratio[2] if axis == 2 else max(ratio[0], ratio[1])
        if judged > 1.0:
            continue
        body_velocity(x, x[4:7], body, jacobian)
        spread = project(p, jacobian[axis], hp) + noise[axis]
        if not apply_update(p, x, hp / spread, hp, body[axis] - measured[axis], limits):
            faults += 1 << axis
    return ((innovation[0], innovation[1], innovation[2]),
            (variance[0], variance[1], variance[2]), (ratio[0], ratio[1], ratio[2]), faults)
