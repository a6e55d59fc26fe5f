"""Full-rate strapdown of the output predictor and its correction towards the filter.

out (10,) is quaternion, velocity, position of the IMU; history (n, 10) the same for the last
filter periods. A complementary filter: A. Khosravian et al., "Recursive attitude estimation in the
presence of multi-rate and multi-delay vector measurements", 2015.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel
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
    angle = np.empty(3)
    spin = 0.0
    for i in range(3):
        rate[i] = delta_angle[i] / angle_dt
        angle[i] = delta_angle[i] - x[10 + i] * bias_scale + correction[i]
        spin += angle[i] * rot[2, i]
    yaw[0] += spin
    yaw[1] = 0.95 * yaw[1] + 0.05 * spin / angle_dt
    out[0:4] = quat_normalise(quat_multiply(out[0:4], quat_from_rotation_vector(angle)))
    rot[:, :] = matrix_from_quat(out[0:4])
    dv0 = delta_velocity[0] - x[13] * bias_scale
    dv1 = delta_velocity[1] - x[14] * bias_scale
    dv2 = delta_velocity[2] - x[15] * bias_scale
    for i in range(3):
        increment = rot[i, 0] * dv0 + rot[i, 1] * dv1 + rot[i, 2] * dv2
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
    norm = np.zeros(2)
    for i in range(6):
        difference = x[4 + i] - history[oldest, 4 + i]
        integral[i] += difference
        gain = vel_gain if i < 3 else pos_gain
        shift = difference * gain + integral[i] * gain * gain * 0.1
        history[:, 4 + i] += shift
        out[4 + i] += shift
        norm[i // 3] += difference * difference
    errors[0] = np.sqrt(error[0] ** 2 + error[1] ** 2 + error[2] ** 2)
    errors[1] = np.sqrt(norm[0])
    errors[2] = np.sqrt(norm[1])
