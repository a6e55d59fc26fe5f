"""Velocity from odometry observed in the body frame, so that its direction tells attitude."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.observation import Observation

Array = NDArray[np.float64]


def fuse_body_velocity(
    f: Filter, horizontal: Observation, vertical: Observation, measured: Array, noise: Array,
    gate: float,
) -> None:
    """Gate and fuse a velocity (3,) in body axes, m/s; noise (3,) variances in (m/s)^2.

    The axes forward and right are judged together, down by itself.
    """
    innovation, variance, ratio, faults = f.cov.fuse_body_velocity(f.x, measured, noise, gate)
    level = horizontal.judge(f.t_now, innovation[0:2], variance[0:2], max(ratio[0:2]))
    down = vertical.judge(f.t_now, innovation[2:3], variance[2:3], ratio[2])
    f.rejections.hor_vel, f.rejections.ver_vel = not level, not down
    if level:
        f.times.hor_vel = f.t_now
        f.faults.vel_n, f.faults.vel_e = faults & 1 != 0, faults & 2 != 0
    if down:
        f.times.ver_vel = f.t_now
        f.faults.vel_d = faults & 4 != 0
