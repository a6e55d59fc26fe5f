"""Airspeed, sideslip and drag: predictions from the velocity against the air, and Jacobians.

Gradients are over the 24 states; the air moves with the wind states, so those of the wind are
minus those of the horizontal velocity.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.body_velocity import body_velocity
from ekf_fusion_ros.kernels.compile import kernel

Array = NDArray[np.float64]

STANDSTILL = 1e-9
"""Speed in m/s along x below which a sideslip has no gradient."""


@kernel
def observe_airspeed(x: Array, h: Array) -> float:
    """Fill h (24,) with the gradient of |v - w| and return it in m/s; h is zero at zero."""
    north, east, down = x[4] - x[22], x[5] - x[23], x[6]
    speed = math.sqrt(north * north + east * east + down * down)
    h[:] = 0.0
    if speed > 0.0:
        h[4], h[5], h[6] = north / speed, east / speed, down / speed
        h[22], h[23] = -h[4], -h[5]
    return speed


@kernel
def relative_wind(x: Array, air: Array, jacobian: Array) -> None:
    """Fill air (3,) with the velocity against the air in body axes, m/s, and jacobian (3, 24)."""
    velocity = x[4:7].copy()
    velocity[0] -= x[22]
    velocity[1] -= x[23]
    jacobian[:, :] = 0.0
    body_velocity(x[0:4], velocity, air, jacobian)
    for i in range(3):
        jacobian[i, 22] = -jacobian[i, 4]
        jacobian[i, 23] = -jacobian[i, 5]


@kernel
def observe_sideslip(air: Array, jacobian: Array, h: Array) -> float:
    """Fill h (24,) with the gradient of v_y / v_x and return that ratio; NaN without motion."""
    if abs(air[0]) < STANDSTILL:
        return math.nan
    slip = float(air[1] / air[0])
    for i in range(24):
        h[i] = (jacobian[1, i] - slip * jacobian[0, i]) / air[0]
    return slip


@kernel
def predict_drag(
    speed: float, measured: float, density: float, ballistic: float, momentum: float, out: Array,
) -> None:
    """Fill out (2,) with the predicted specific force in m/s^2 and its slope in 1/s.

    The force along one axis at an airspeed in m/s is
        -sign(v) rho v^2 / (2 B) - m v,
    with bluff-body drag B in kg/m^2 and momentum drag m in 1/s, either of which may be zero = not
    modelled. It is linearised at the airspeed that explains the measured force.
    """
    force = abs(measured)
    slope = momentum
    predicted = -momentum * speed
    if ballistic > 0.0:
        per_speed = density / ballistic
        explained = (math.sqrt(momentum * momentum + 2.0 * per_speed * force) - momentum
                     ) / per_speed
        slope += per_speed * explained
        predicted -= 0.5 * per_speed * speed * abs(speed)
    out[0] = predicted
    out[1] = max(slope, 0.1)
