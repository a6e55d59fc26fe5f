"""Innovation variance of any scalar observation with a Jacobian over all states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import COMPILED
from ekf_fusion_ros.kernels.compile import kernel

Array = NDArray[np.float64]


@kernel
def _project_by_element(p: Array, h: Array, hp: Array) -> float:
    hp[:] = 0.0
    for i in range(h.shape[0]):
        slope = h[i]
        if slope != 0.0:
            for j in range(24):
                hp[j] += slope * p[i, j]
    variance = 0.0
    for i in range(h.shape[0]):
        variance += hp[i] * h[i]
    return variance


def _project_as_arrays(p: Array, h: Array, hp: Array) -> float:
    np.dot(h, p[0:len(h)], hp)
    return float(np.dot(hp[0:len(h)], h))


project = _project_by_element if COMPILED else _project_as_arrays
"""Fill hp (24,) with H P and return H P H' for a Jacobian h by the first states, or all, and a
symmetric P (24, 24). Most of a Jacobian is zero."""
