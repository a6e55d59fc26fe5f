"""Full-rate strapdown of the output predictor and its correction towards the filter.

out (10,) is quaternion, velocity, position of the IMU; history (n, 10) the same for the last
filter periods. A complementary filter: A. Khosravian et al., "Recursive attitude estimation in the
presence of multi-rate and multi-delay vector measurements", 2015.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import COMPILED
from ekf_fusion_ros.kernels.compile import four
from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.kernels.compile import three
from ekf_fusion_ros.kernels.prediction import GRAVITY
from ekf_fusion_ros.mathlib.rotation import exponential
from ekf_fusion_ros.mathlib.rotation import fill_matrix
from ekf_fusion_ros.mathlib.rotation import rotate

Array = NDArray[np.float64]

OUTPUT = np.dtype([
    ('now', 'f8', (10,)), ('rot', 'f8', (3, 3)), ('correction', 'f8', (3,)), ('yaw', 'f8', (2,)),
    ('rate', 'f8', (3,)), ('acceleration', 'f8', (3,)), ('integral', 'f8', (6,)),
    ('tracking_error', 'f8', (3,)), ('running', 'f8'), ('taus', 'f8', (2,)),
    ('periods', 'i8', (1,))])
"""What the output predictor keeps beside its history: its state and what corrects it, the time
constants of velocity and position in s, the periods so far. It runs once it has been aligned."""


@kernel
def propagate_predictor(
    state: NDArray[np.void], raw: Array, x: Array, bias_scale: float,
) -> None:
    """Run propagate_output on one OUTPUT over a raw sample (8,), if it is running."""
    s = state[0]
    if s['running'] != 0.0:
        propagate_output(s['now'], s['rot'], raw[0:3], raw[3:6], raw[6], raw[7], x, bias_scale,
                         s['correction'], s['yaw'], s['rate'], s['acceleration'])


@kernel
def correct_predictor(
    state: NDArray[np.void], history: Array, x: Array, dt_imu_avg: float, dt_avg: float,
    delay: float,
) -> None:
    """Add the present of one OUTPUT to the history and run correct_output on it.

    The filter state x (24,) lies delay s in the past; dt_imu_avg, dt_avg: mean interval of raw
    samples and mean filter period in s.
    """
    s = state[0]
    periods, size = s['periods'], len(history)
    newest = periods[0] % size
    periods[0] += 1
    oldest = periods[0] % size if periods[0] >= size else 0
    history[newest, :] = s['now']
    correct_output(s['now'], history, oldest, x, s['integral'],
                   0.5 * dt_imu_avg / max(delay, dt_imu_avg),
                   dt_avg / max(s['taus'][0], dt_avg), dt_avg / max(s['taus'][1], dt_avg),
                   s['correction'], s['tracking_error'])


@kernel
def propagate_output(
    out: Array, rot: Array, delta_angle: Array, delta_velocity: Array, angle_dt: float,
    velocity_dt: float, x: Array, bias_scale: float, correction: Array, yaw: Array, rate: Array,
    acceleration: Array,
) -> None:
    """Advance out (10,) and rot (3, 3) by one raw IMU sample, in place.

    bias_scale turns biases per filter period into biases per raw sample; correction (3,) rad;
    yaw (2,) accumulates the turn about the vertical and low-passes its rate; rate (3,) receives
    the raw body rate, acceleration (3,) that against the earth, gravity and bias taken off.
    """
    d0, d1, d2 = three(delta_angle)
    b0, b1, b2 = three(x[10:13])
    c0, c1, c2 = three(correction)
    rate[0], rate[1], rate[2] = d0 / angle_dt, d1 / angle_dt, d2 / angle_dt
    a0 = d0 - b0 * bias_scale + c0
    a1 = d1 - b1 * bias_scale + c1
    a2 = d2 - b2 * bias_scale + c2
    z0, z1, z2 = three(rot[2])
    spin = a0 * z0 + a1 * z1 + a2 * z2
    yaw[0] += spin
    yaw[1] = 0.95 * yaw[1] + 0.05 * spin / angle_dt
    q0, q1, q2, q3 = exponential(a0, a1, a2)
    rotate(out, q0, q1, q2, q3)
    fill_matrix(out, rot)
    d0, d1, d2 = three(delta_velocity)
    b0, b1, b2 = three(x[13:16])
    v0, v1, v2 = d0 - b0 * bias_scale, d1 - b1 * bias_scale, d2 - b2 * bias_scale
    for i in range(3):
        r0, r1, r2 = three(rot[i])
        increment = r0 * v0 + r1 * v1 + r2 * v2
        if i == 2:
            increment += GRAVITY * velocity_dt
        acceleration[i] = increment / velocity_dt
        before = out[4 + i]
        out[4 + i] = before + increment
        out[7 + i] += 0.5 * (before + out[4 + i]) * velocity_dt


@kernel
def attitude_error(q: Array, oldest: Array) -> tuple[float, float, float]:
    """Return the small rotation in rad from the oldest output to the filter attitude."""
    w, x, y, z = four(q)
    o0, o1, o2, o3 = four(oldest)
    x, y, z = -x, -y, -z
    e0 = w * o0 - x * o1 - y * o2 - z * o3
    e1 = w * o1 + x * o0 + y * o3 - z * o2
    e2 = w * o2 - x * o3 + y * o0 + z * o1
    e3 = w * o3 + x * o2 - y * o1 + z * o0
    scale = -2.0 / math.sqrt(e0 * e0 + e1 * e1 + e2 * e2 + e3 * e3)
    if e0 < 0.0:
        scale = -scale
    return scale * e1, scale * e2, scale * e3


@kernel
def _shift_by_element(history: Array, shift: Array) -> None:
    for k in range(history.shape[0]):
        for i in range(6):
            history[k, 4 + i] += shift[i]


def _shift_as_arrays(history: Array, shift: Array) -> None:
    history[:, 4:10] += shift


shift_history = _shift_by_element if COMPILED else _shift_as_arrays
"""Move velocity and position of a history (n, 10) by a shift (6,)."""


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
    e0, e1, e2 = attitude_error(x, history[oldest])
    correction[0], correction[1], correction[2] = e0 * att_gain, e1 * att_gain, e2 * att_gain
    errors[0] = length(e0, e1, e2)
    difference, shift = np.empty(6), np.empty(6)
    for i in range(6):
        gain = vel_gain if i < 3 else pos_gain
        difference[i] = x[4 + i] - history[oldest, 4 + i]
        integral[i] += difference[i]
        shift[i] = difference[i] * gain + integral[i] * (gain * gain * 0.1)
        out[4 + i] += shift[i]
    shift_history(history, shift)
    d0, d1, d2 = three(difference)
    errors[1] = length(d0, d1, d2)
    d0, d1, d2 = three(difference[3:6])
    errors[2] = length(d0, d1, d2)


@kernel
def length(v0: float, v1: float, v2: float) -> float:
    """Return the length of a vector."""
    return math.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
