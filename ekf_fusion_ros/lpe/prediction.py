"""Prediction of state and covariance from attitude and specific force.

The model is x' = A x + B u + w with u = R f + g, the acceleration NED that the accelerometer
gives: position' = velocity, velocity' = u - R bias, bias' = 0, terrain' = 0. Its noise is white:
intensity of u by the accelerometer, Q of the process (Gelb, "Applied Optimal Estimation", 1974,
section 4.3). Figures and limits: PX4 1.13, local_position_estimator.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.lpe.state import ACCEL_BIAS
from ekf_fusion_ros.lpe.state import PD
from ekf_fusion_ros.lpe.state import POSITION
from ekf_fusion_ros.lpe.state import SIZE
from ekf_fusion_ros.lpe.state import TERRAIN
from ekf_fusion_ros.lpe.state import VE
from ekf_fusion_ros.lpe.state import VELOCITY
from ekf_fusion_ros.lpe.state import VN
from ekf_fusion_ros.lpe.validity import Validity
from ekf_fusion_ros.params.lpe import ProcessParams

Array = NDArray[np.float64]

GRAVITY = np.array((0.0, 0.0, 9.80665))
BIAS_MAX = 0.1
"""m/s^2; a larger bias is more likely an error of attitude."""

VARIANCE_MAX = 1e6
INITIAL_SIGMA = 2.0
"""m, times sqrt(2), of position and terrain."""

INITIAL_BIAS_VARIANCE = 1e-6
HORIZONTAL = [0, 1, 3, 4]


def initial_covariance(params: ProcessParams) -> Array:
    """Return the covariance (10, 10) before the first measurement."""
    variance = np.full(SIZE, 2.0 * INITIAL_SIGMA ** 2)
    variance[VELOCITY] = 2.0 * params.velocity_sigma_max ** 2
    variance[ACCEL_BIAS] = INITIAL_BIAS_VARIANCE
    return np.diag(variance)


def dynamics_matrix(rot: Array) -> Array:
    """Return A (10, 10) for a rotation matrix (3, 3) body to NED."""
    A = np.zeros((SIZE, SIZE))
    A[POSITION, VELOCITY] = np.eye(3)
    A[VELOCITY, ACCEL_BIAS] = -rot
    return A


def input_matrix() -> Array:
    """Return B (10, 3): the input is an acceleration NED."""
    B = np.zeros((SIZE, 3))
    B[VELOCITY] = np.eye(3)
    return B


def runge_kutta_step(x: Array, A: Array, Bu: Array, dt: float) -> Array:
    """Return the change of x over dt s by the classical fourth-order rule, A and Bu held."""
    k1 = A @ x + Bu
    k2 = A @ (x + 0.5 * dt * k1) + Bu
    k3 = A @ (x + 0.5 * dt * k2) + Bu
    k4 = A @ (x + dt * k3) + Bu
    return (dt / 6.0) * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def predicted_state(x: Array, A: Array, u: Array, dt: float, valid: Validity) -> Array:
    """Return x (10,) after dt s at acceleration u (3,) NED; what is not valid does not move.

    The bias is saturated here, so that corrections cannot carry it far.
    """
    Bu = np.zeros(SIZE)
    Bu[VELOCITY] = u
    dx = runge_kutta_step(x, A, Bu, dt)
    if not valid.horizontal:
        dx[HORIZONTAL] = 0.0
    if not valid.height:
        dx[PD] = 0.0
    if not valid.terrain:
        dx[TERRAIN] = 0.0
    predicted = x + dx
    predicted[ACCEL_BIAS] = np.clip(predicted[ACCEL_BIAS], -BIAS_MAX, BIAS_MAX)
    return predicted


def noise_intensity(x: Array, params: ProcessParams) -> Array:
    """Return the diagonal (10,) of B R B^T + Q, in the squares of the units of x per s.

    PX4 takes the terrain noise of the speed at the last change of a parameter; here it follows
    the speed.
    """
    diagonal = np.empty(SIZE)
    diagonal[POSITION] = params.position_noise ** 2
    diagonal[VELOCITY] = params.velocity_noise ** 2 + np.array(
        (params.accel_noise_xy, params.accel_noise_xy, params.accel_noise_z)) ** 2
    diagonal[ACCEL_BIAS] = params.bias_noise ** 2
    speed = float(np.hypot(x[VN], x[VE]))
    diagonal[TERRAIN] = (params.terrain_noise + 0.01 * params.terrain_grade * speed) ** 2
    return diagonal


def predicted_covariance(P: Array, A: Array, intensity: Array, dt: float) -> Array:
    """Return P (10, 10) after dt s: one Euler step of P' = A P + P A^T + diag(intensity).

    A variance above the limit stops growing, and with it all its covariances.
    """
    AP = A @ P
    dP = AP + AP.T
    dP[np.diag_indices(SIZE)] += intensity
    dP *= dt
    too_large = np.diag(P) > VARIANCE_MAX
    if too_large.any():
        dP[too_large] = 0.0
        dP[:, too_large] = 0.0
    return P + dP


def is_sound(P: Array) -> bool:
    """Return whether a covariance is finite with positive variances."""
    return bool(np.isfinite(P).all() and (np.diag(P) > 0.0).all())
