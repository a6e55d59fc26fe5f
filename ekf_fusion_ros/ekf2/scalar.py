"""Gate and fusion of a scalar observation with a Jacobian over all states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.kernels.update import test_ratio
from ekf_fusion_ros.observation import Observation

Array = NDArray[np.float64]


def passes(
    f: Filter, record: Observation, innovation: float, variance: float, gate: float,
) -> bool:
    """Take an attempt down in its record; True, and counted as fused, where it passes its gate."""
    ratio = test_ratio(innovation, variance, gate)
    return record.note(f.t_now, (innovation,), (variance,), ratio, ratio <= 1.0)


def fuse_scalar(
    f: Filter, hp: Array, variance: float, innovation: float, *, wind_only: bool = False,
) -> bool:
    """Fuse an observation with H P (24,) and its innovation variance; False on a fault.

    wind_only: correct no state but the wind.
    """
    gain = hp / variance
    if wind_only:
        gain[0:22] = 0.0
    else:
        gain[13:16] *= 1.0 - f.cov.inhibited
        if not f.flags.wind:
            gain[22:24] = 0.0
    return f.cov.fuse(f.x, gain, hp, innovation)
