"""Velocity from odometry observed in the body frame, so that its direction tells attitude."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.kernels.vision import turn_velocity
from ekf_fusion_ros.mathlib.rotation import cross
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.observation import Observation
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]

def vision_velocity_in_body(f: Filter, sample: VisionSample) -> tuple[Array, Array]:
    """Return the velocity (3,) of a sample along the body axes at the IMU, and its variances (3,).

    m/s. A velocity of the odometry frame is turned by the attitude of the odometry.
    """
    velocity, variance = sample.velocity, sample.velocity_cov.diagonal()
    if sample.velocity_frame is not VelocityFrame.BODY_FRD:
        turn = np.ascontiguousarray(matrix_from_quat(sample.quaternion).T)
        velocity, variance = map(
            np.array, turn_velocity(turn, sample.velocity, sample.velocity_cov))
    if f.vision_lever is not None:
        velocity = velocity - cross(f.rate, f.vision_lever)
    return velocity, variance


def fuse_body_velocity(
    f: Filter, horizontal: Observation, vertical: Observation, measured: Array, noise: Array,
    gate: float,
) -> None:
    """Gate and fuse a velocity (3,) in body axes, m/s; noise (3,) variances in (m/s)^2.

    The axes forward and right are judged together, down by itself.
    """
    innovation, variance, ratio, faults = f.cov.fuse_body_velocity(f.x, measured, noise, gate)
    worst = max(ratio[0:2])
    level = horizontal.note(f.t_now, innovation[0:2], variance[0:2], worst, worst <= 1.0)
    down = vertical.note(f.t_now, innovation[2:3], variance[2:3], ratio[2], ratio[2] <= 1.0)
    f.rejections.hor_vel, f.rejections.ver_vel = not level, not down
    if level:
        f.times.hor_vel = f.t_now
        f.faults.vel_n, f.faults.vel_e = faults & 1 != 0, faults & 2 != 0
    if down:
        f.times.ver_vel = f.t_now
        f.faults.vel_d = faults & 4 != 0
