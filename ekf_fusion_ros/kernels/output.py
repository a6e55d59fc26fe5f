"""Full-rate strapdown of the output predictor and its correction towards the filter.

out (10,) is quaternion, velocity, position of the IMU; history (n, 10) the same for the last
filter periods. A complementary filter: A. Khosravian et al., "Recursive attitude estimation in the
presence of multi-rate and multi-delay vector measurements", 2015.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.kernels.compile import three
from ekf_fusion_ros.kernels.prediction import GRAVITY
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import quat_from_rotation_vector
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.mathlib.rotation import quat_normalise

Array = NDArray[np.float64]

OUTPUT = np.dtype([
    ('now', 'f8', (10,)), ('rot', 'f8', (3, 3)), ('correction', 'f8', (3,)), ('yaw', 'f8', (2,)),
    ('rate', 'f8', (3,)), ('integral', 'f8', (6,)), ('tracking_error', 'f8', (3,))])
"""What the output predictor keeps beside its history."""


@kernel
def propagate_predictor(
    state: NDArray[np.void], delta_angle: Array, delta_velocity: Array, angle_dt: float,
    velocity_dt: float, x: Array, bias_scale: float,
) -> None:
    """Run propagate_output on one OUTPUT."""
    s = state[0]
    propagate_output(s['now'], s['rot'], delta_angle, delta_velocity, angle_dt, velocity_dt, x,
                     bias_scale, s['correction'], s['yaw'], s['rate'])


@kernel
def correct_predictor(
    state: NDArray[np.void], history: Array, newest: int, oldest: int, x: Array, att_gain: float,
    vel_gain: float, pos_gain: float,
) -> None:
    """Add the present of one OUTPUT to the history and run correct_output on it."""
    s = state[0]
    history[newest, :] = s['now']
    correct_output(s['now'], history, oldest, x, s['integral'], att_gain, vel_gain, pos_gain,
                   s['correction'], s['tracking_error'])


@kernel
def propagate_output(
    out: Array, rot: Array, delta_angle: Array, delta_velocity: Array, angle_dt: float,
    velocity_dt: float, x: Array, bias_scale: float, correction: Array, yaw: Array, rate: Array,
) -> None:
    """Advance out (10,) and rot (3, 3) by one raw IMU sample, in place.

    bias_scale turns biases per filter period into biases per raw sample; correction (3,) rad;
    yaw (2,) accumulates the turn about the vertical and low-passes its rate; rate (3,) receives
    the raw body rate.
    """
    rate[:] = delta_angle / angle_dt
    angle = delta_angle - x[10:13] * bias_scale + correction
    a0, a1, a2 = three(angle)
    z0, z1, z2 = three(rot[2])
    spin = a0 * z0 + a1 * z1 + a2 * z2
    yaw[0] += spin
    yaw[1] = 0.95 * yaw[1] + 0.05 * spin / angle_dt
    out[0:4] = quat_normalise(quat_multiply(out[0:4], quat_from_rotation_vector(angle)))
    rot[:, :] = matrix_from_quat(out[0:4])
    dv0, dv1, dv2 = three(delta_velocity - x[13:16] * bias_scale)
    for i in range(3):
        r0, r1, r2 = three(rot[i])
        increment = r0 * dv0 + r1 * dv1 + r2 * dv2
        if i == 2:
            increment += GRAVITY * velocity_dt
        before = out[4 + i]
        out[4 + i] = before + increment
        out[7 + i] += 0.5 * (before + out[4 + i]) * velocity_dt


@kernel
def attitude_error(q: Array, oldest: Array) -> Array:
    """Return the small rotation (3,) in rad from the oldest output to the filter attitude."""
    w, x, y, z = q[0], -q[1], -q[2], -q[3]
    error = quat_normalise(quat_multiply(np.array((w, x, y, z)), oldest))
    scale = -2.0
    if error[0] < 0.0:
        scale = 2.0
    return scale * error[1:4]


@kernel
def correct_output(
    out: Array, history: Array, oldest: int, x: Array, integral: Array, att_gain: float,
    vel_gain: float, pos_gain: float, correction: Array, errors: Array,
) -> None:
    """Compare the oldest entry of the history with the filter state x (24,), in place.

    correction (3,) receives the attitude correction for each of the coming raw samples. Velocity
    and position of the whole history move towards the filter (PI); integral (6,) of their errors.
    errors (3,) receives the norms of the attitude, velocity and position errors.
    """
    error = attitude_error(x[0:4], history[oldest, 0:4])
    correction[:] = error * att_gain
    difference = x[4:10] - history[oldest, 4:10]
    integral += difference
    shift = np.empty(6)
    shift[0:3] = difference[0:3] * vel_gain + integral[0:3] * (vel_gain * vel_gain * 0.1)
    shift[3:6] = difference[3:6] * pos_gain + integral[3:6] * (pos_gain * pos_gain * 0.1)
    history[:, 4:10] += shift
    out[4:10] += shift
    errors[0] = length(error)
    errors[1] = length(difference[0:3])
    errors[2] = length(difference[3:6])


@kernel
def length(v: Array) -> float:
    """Return |v| of a vector (3,)."""
    v0, v1, v2 = three(v)
    return math.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
