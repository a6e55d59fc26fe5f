"""Innovation variance of any scalar observation with a Jacobian over all states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel

Array = NDArray[np.float64]


@kernel
def project(p: Array, h: Array, hp: Array) -> float:
    """Fill hp (24,) with H P and return H P H' for a Jacobian h (24,) and a symmetric P."""
    np.dot(h, p, hp)
    return float(np.dot(hp, h))
