"""Gate and fusion of a scalar observation with a Jacobian over all states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.observation import Observation

Array = NDArray[np.float64]


def gate_ratio(innovation: float, variance: float, gate: float) -> float:
    """Return innovation^2 / (gate^2 variance); the gate is at least one sigma."""
    gate = max(gate, 1.0)
    return innovation * innovation / (gate * gate * variance)


def passes(
    f: Filter, record: Observation, innovation: float, variance: float, gate: float,
) -> bool:
    """Take an attempt down in its record; True, and counted as fused, where it passes its gate."""
    record.record(f.t_now, (innovation,), (variance,), gate_ratio(innovation, variance, gate))
    if record.test_ratio > 1.0:
        record.reject()
        return False
    record.accept()
    return True


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
