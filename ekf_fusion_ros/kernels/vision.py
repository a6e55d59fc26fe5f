"""Odometry turned into the frame of the filter."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel

Array = NDArray[np.float64]
Three = tuple[float, float, float]


@kernel
def turn_velocity(turn: Array, velocity: Array, covariance: Array) -> tuple[Three, Three]:
    """Return turn (3, 3) times velocity (3,) and the variances of that, from covariance (3, 3)."""
    c = turn @ covariance
    v0 = turn[0, 0] * velocity[0] + turn[0, 1] * velocity[1] + turn[0, 2] * velocity[2]
    v1 = turn[1, 0] * velocity[0] + turn[1, 1] * velocity[1] + turn[1, 2] * velocity[2]
    v2 = turn[2, 0] * velocity[0] + turn[2, 1] * velocity[1] + turn[2, 2] * velocity[2]
    s0 = c[0, 0] * turn[0, 0] + c[0, 1] * turn[0, 1] + c[0, 2] * turn[0, 2]
    s1 = c[1, 0] * turn[1, 0] + c[1, 1] * turn[1, 1] + c[1, 2] * turn[1, 2]
    s2 = c[2, 0] * turn[2, 0] + c[2, 1] * turn[2, 1] + c[2, 2] * turn[2, 2]
    return (v0, v1, v2), (s0, s1, s2)


@kernel
def turn_displacement(
    turn: Array, position: Array, variance: Array, before: Array, variance_before: Array,
) -> tuple[float, float, float, float]:
    """Return the NE displacement in m between two positions (3,) and its variances in m^2.

    turn (3, 3) leads from the odometry frame to NED. An unmeasured height must not reach north and
    east through the rotation: where it is NaN it counts as zero and known.
    """
    last = 3 if math.isfinite(position[2] - before[2]) else 2
    north = east = north_var = east_var = 0.0
    for i in range(last):
        moved = position[i] - before[i]
        spread = variance[i] + variance_before[i]
        north += turn[0, i] * moved
        east += turn[1, i] * moved
        north_var += turn[0, i] * turn[0, i] * spread
        east_var += turn[1, i] * turn[1, i] * spread
    return north, east, north_var, east_var
