"""Velocity from odometry observed in the body frame, so that its direction tells attitude."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.observation import Observation
from ekf_fusion_ros.kernels.update import test_ratio
from ekf_fusion_ros.mathlib.rotation import cross
from ekf_fusion_ros.mathlib.rotation import cross_matrix
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat

Array = NDArray[np.float64]

FAULTS = ('vel_n', 'vel_e', 'vel_d')


def body_velocity_jacobian(q: Array, velocity: Array) -> Array:
    """Return d(R(q)^T v)/d(q), (3, 4), for the homogeneous rotation matrix.

    From R^T v = (w^2 - u.u) v + 2 u (u.v) - 2 w (u x v) with q = (w, u).
    """
    w, u = q[0], q[1:4]
    jacobian = np.empty((3, 4))
    jacobian[:, 0] = 2.0 * (w * velocity - cross(u, velocity))
    jacobian[:, 1:4] = 2.0 * (
        np.outer(u, velocity) - np.outer(velocity, u) + (u @ velocity) * np.eye(3)
        + w * cross_matrix(velocity))
    return jacobian


def fuse_body_velocity(
    f: Filter, horizontal: Observation, vertical: Observation, measured: Array, noise: Array,
    gate: float,
) -> None:
    """Gate and fuse a velocity (3,) in body axes, m/s; noise (3,) variances in (m/s)^2.

    The axes forward and right are judged together, down by itself.
    """
    innovation, h = _observe(f, measured)
    variance = np.einsum('ij,jk,ik->i', h, f.cov.p[0:7, 0:7], h) + noise
    ratio = [test_ratio(float(innovation[i]), float(variance[i]), gate) for i in range(3)]
    horizontal.record(f.t_now, innovation[0:2].tolist(), variance[0:2].tolist(), max(ratio[0:2]))
    vertical.record(f.t_now, innovation[2:3].tolist(), variance[2:3].tolist(), ratio[2])
    f.rejections.hor_vel = horizontal.test_ratio > 1.0
    f.rejections.ver_vel = vertical.test_ratio > 1.0
    if f.rejections.hor_vel:
        horizontal.reject()
    else:
        horizontal.accept()
        f.times.hor_vel = f.t_now
        _fuse_axis(f, 0, measured, noise)
        _fuse_axis(f, 1, measured, noise)
    if f.rejections.ver_vel:
        vertical.reject()
    else:
        vertical.accept()
        f.times.ver_vel = f.t_now
        _fuse_axis(f, 2, measured, noise)


def _observe(f: Filter, measured: Array) -> tuple[Array, Array]:
    """Return innovation (3,), predicted minus measured, and d(predicted)/d(states 0..6)."""
    rot = matrix_from_quat(f.x[0:4])
    h = np.hstack((body_velocity_jacobian(f.x[0:4], f.x[4:7]), rot.T))
    innovation: Array = rot.T @ f.x[4:7] - measured
    return innovation, h


def _fuse_axis(f: Filter, axis: int, measured: Array, noise: Array) -> None:
    """Fuse one axis about the state that the axes before have corrected."""
    innovation, h = _observe(f, measured)
    ph = f.cov.p[:, 0:7] @ h[axis]
    variance = float(h[axis] @ ph[0:7]) + float(noise[axis])
    healthy = f.cov.fuse(f.x, ph / variance, ph, float(innovation[axis]))
    setattr(f.faults, FAULTS[axis], not healthy)
