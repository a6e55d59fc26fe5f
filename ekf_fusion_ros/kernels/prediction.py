"""State and covariance prediction over one delayed inertial sample.

State order: quaternion body to earth (0-3), velocity NED (4-6), position NED (7-9), delta-angle
bias (10-12), delta-velocity bias (13-15), earth field (16-18), body field (19-21), wind NE
(22-23). Process model (Sola 2017, section 4, with the quaternion itself as state):
    q+ = q [1, (da - ba) / 2],   v+ = v + R(q) (dv - bv) + g dt,   p+ = p + v dt.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import COMPILED
from ekf_fusion_ros.kernels.compile import four
from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.kernels.compile import three
from ekf_fusion_ros.kernels.update import ACCEL_BIAS_VARIANCE_MAX
from ekf_fusion_ros.kernels.update import MAG_ACTIVE
from ekf_fusion_ros.kernels.update import WIND_ACTIVE
from ekf_fusion_ros.kernels.update import limit_covariance
from ekf_fusion_ros.mathlib.rotation import exponential
from ekf_fusion_ros.mathlib.rotation import fill_matrix
from ekf_fusion_ros.mathlib.rotation import rotate

Array = NDArray[np.float64]
GRAVITY = 9.80665
NOMINAL_PERIOD = 0.01
POSITION_LOST_VARIANCE = 1e4
"""Horizontal position variance in m^2 (sum of both axes) from which it is not propagated."""

FIELD_LEARNED_VARIANCE = 0.1
WIND_LEARNED_VARIANCE = 1.0
HEIGHT_RATE_TIME = 10.0
"""Time constant in s of the height rate by which the wind changes faster."""

WIND_NOISE_BY_HEIGHT_RATE = 0.5
"""Relative growth of the wind noise per m/s of height rate: wind shears with height."""

DRIFT_SPEED = 1.0
"""Speed in m/s above which the position drift of dead reckoning grows no more."""

PROCESS = np.dtype([
    ('transition', 'f8', (10, 24)), ('angle_var', 'f8'), ('velocity_var', 'f8', (3,)),
    ('noise', 'f8', (24,)), ('height_rate', 'f8'), ('wind_noise', 'f8'),
    ('position_drift_var', 'f8'), ('yaw_drift_var', 'f8'), ('accel_lpf', 'f8', (2,)),
    ('travel', 'f8', (2,)),
    ('accel_bias_limit', 'f8'), ('saved', 'f8', (3,)), ('peaks', 'f8', (2,)),
    ('peak_limits', 'f8', (2,)), ('peak_decay', 'f8')])
"""What the prediction keeps and is told: scratch for F, noise of the increments in rad^2 and
(m/s)^2, additive noise of the states, the low-passed height rate in m/s, sigma of the wind and
drift variances per period, the leaky sum of predict_state, the predicted displacement NE in m
since it was last asked for; the largest accelerometer bias in m/s^2, variances of frozen ones, and
peaks of rate in rad/s and specific force in m/s^2, above whose limits none is learned, with the
factor per period by which they fall."""


STATE_LIMITS = np.repeat(
    (1.0, 1e3, 1e6, math.radians(20.0), 1.0, 1.0, 0.5, 100.0), (4, 3, 3, 3, 3, 3, 3, 2))
"""What is physically possible in the units of the state; gyro bias in rad/s, and accelerometer
bias in terms of its own limit."""


@kernel
def predict_state(x: Array, rot: Array, imu: Array, earth_rate: Array, accel_lpf: Array) -> None:
    """Strapdown of x (24,) and the cached rotation (3, 3) over imu (8,), in place.

    earth_rate (3,) rad/s NED. accel_lpf (2,) is a leaky sum of the horizontal velocity increments,
    m/s^2 for a time constant of 1 s.
    """
    a0, a1, a2 = three(imu)
    b0, b1, b2 = three(x[10:13])
    e0, e1, e2 = three(earth_rate)
    n0, n1, n2 = three(rot[0])
    m0, m1, m2 = three(rot[1])
    d0, d1, d2 = three(rot[2])
    dt = float(imu[6])
    q0, q1, q2, q3 = exponential(
        a0 - b0 - (e0 * n0 + e1 * m0 + e2 * d0) * dt,
        a1 - b1 - (e0 * n1 + e1 * m1 + e2 * d1) * dt,
        a2 - b2 - (e0 * n2 + e1 * m2 + e2 * d2) * dt)
    rotate(x, q0, q1, q2, q3)
    fill_matrix(x, rot)
    a0, a1, a2 = three(imu[3:6])
    b0, b1, b2 = three(x[13:16])
    dv0, dv1, dv2 = a0 - b0, a1 - b1, a2 - b2
    dt = float(imu[7])
    decay = 1.0 - dt
    for i in range(3):
        r0, r1, r2 = three(rot[i])
        increment = r0 * dv0 + r1 * dv1 + r2 * dv2
        if i < 2:
            accel_lpf[i] = accel_lpf[i] * decay + increment
        else:
            increment += GRAVITY * dt
        previous = x[4 + i]
        x[4 + i] = previous + increment
        x[7 + i] += 0.5 * (previous + x[4 + i]) * dt


@kernel
def limit_state(x: Array, dt: float, accel_bias_limit: float) -> None:
    """Clamp x (24,) to what is physically possible; dt is the mean filter period in s."""
    limits = STATE_LIMITS.copy()
    limits[10:13] *= dt
    limits[13:16] *= accel_bias_limit * dt
    x[:] = np.minimum(np.maximum(x, -limits), limits)


@kernel
def fill_transition(q: Array, da: Array, dv: Array, dt: float, f: Array) -> None:
    """Write the rows of F that are not identity into f (10, 24), zeroed elsewhere before.

    q (4,) is the predicted attitude, da and dv (3,) the bias-corrected increments. R(q) is
    differentiated in its unit-norm form (diagonal 1 - 2(..)), the one used by the prediction.
    """
    q0, q1, q2, q3 = four(q)
    a, b, c = three(0.5 * da)
    f[0, 0], f[0, 1], f[0, 2], f[0, 3] = 1.0, -a, -b, -c
    f[1, 0], f[1, 1], f[1, 2], f[1, 3] = a, 1.0, c, -b
    f[2, 0], f[2, 1], f[2, 2], f[2, 3] = b, -c, 1.0, a
    f[3, 0], f[3, 1], f[3, 2], f[3, 3] = c, b, -a, 1.0
    f[0, 10], f[0, 11], f[0, 12] = 0.5 * q1, 0.5 * q2, 0.5 * q3
    f[1, 10], f[1, 11], f[1, 12] = -0.5 * q0, 0.5 * q3, -0.5 * q2
    f[2, 10], f[2, 11], f[2, 12] = -0.5 * q3, -0.5 * q0, 0.5 * q1
    f[3, 10], f[3, 11], f[3, 12] = 0.5 * q2, -0.5 * q1, -0.5 * q0
    x, y, z = three(dv)
    f[4, 0] = 2.0 * (q2 * z - q3 * y)
    f[4, 1] = 2.0 * (q2 * y + q3 * z)
    f[4, 2] = 2.0 * (q1 * y + q0 * z) - 4.0 * q2 * x
    f[4, 3] = 2.0 * (q1 * z - q0 * y) - 4.0 * q3 * x
    f[5, 0] = 2.0 * (q3 * x - q1 * z)
    f[5, 1] = 2.0 * (q2 * x - q0 * z) - 4.0 * q1 * y
    f[5, 2] = 2.0 * (q1 * x + q3 * z)
    f[5, 3] = 2.0 * (q0 * x + q2 * z) - 4.0 * q3 * y
    f[6, 0] = 2.0 * (q1 * y - q2 * x)
    f[6, 1] = 2.0 * (q3 * x + q0 * y) - 4.0 * q1 * z
    f[6, 2] = 2.0 * (q3 * y - q0 * x) - 4.0 * q2 * z
    f[6, 3] = 2.0 * (q1 * x + q2 * y)
    rot = f[4:7, 13:16]
    fill_matrix(q, rot)
    for i in range(3):
        for j in range(3):
            rot[i, j] = -rot[i, j]
        f[4 + i, 4 + i] = 1.0
        f[7 + i, 7 + i] = 1.0
        f[7 + i, 4 + i] = dt


@kernel
def _add_unless_learned(p: Array, noise: Array, first: int, size: int, limit: float) -> None:
    """Let slowly varying states drift only while their variances sum to less than a limit."""
    total = 0.0
    for i in range(first, first + size):
        total += p[i, i]
    if total < limit:
        for i in range(first, first + size):
            p[i, i] += noise[i]


@kernel
def _propagate_by_element(
    f: Array, p: Array, angle_var: float, velocity_var: Array,
) -> tuple[Array, Array]:
    top = np.empty((10, 24))
    for i in range(4):
        for j in range(24):
            top[i, j] = (f[i, 0] * p[0, j] + f[i, 1] * p[1, j] + f[i, 2] * p[2, j]
                         + f[i, 3] * p[3, j] + f[i, 10] * p[10, j] + f[i, 11] * p[11, j]
                         + f[i, 12] * p[12, j])
    for i in range(4, 7):
        for j in range(24):
            top[i, j] = (p[i, j] + f[i, 0] * p[0, j] + f[i, 1] * p[1, j] + f[i, 2] * p[2, j]
                         + f[i, 3] * p[3, j] + f[i, 13] * p[13, j] + f[i, 14] * p[14, j]
                         + f[i, 15] * p[15, j])
    for i in range(7, 10):
        for j in range(24):
            top[i, j] = p[i, j] + f[i, i - 3] * p[i - 3, j]
    block = np.empty((10, 10))
    for i in range(10):
        for j in range(min(i + 1, 4)):
            block[i, j] = (top[i, 0] * f[j, 0] + top[i, 1] * f[j, 1] + top[i, 2] * f[j, 2]
                           + top[i, 3] * f[j, 3] + top[i, 10] * f[j, 10] + top[i, 11] * f[j, 11]
                           + top[i, 12] * f[j, 12])
        for j in range(4, min(i + 1, 7)):
            block[i, j] = (top[i, j] + top[i, 0] * f[j, 0] + top[i, 1] * f[j, 1]
                           + top[i, 2] * f[j, 2] + top[i, 3] * f[j, 3] + top[i, 13] * f[j, 13]
                           + top[i, 14] * f[j, 14] + top[i, 15] * f[j, 15])
        for j in range(7, i + 1):
            block[i, j] = top[i, j] + top[i, j - 3] * f[j, j - 3]
    for i in range(4):
        for j in range(i + 1):
            block[i, j] += angle_var * (
                f[i, 10] * f[j, 10] + f[i, 11] * f[j, 11] + f[i, 12] * f[j, 12])
    for i in range(4, 7):
        for j in range(4, i + 1):
            block[i, j] += (velocity_var[0] * f[i, 13] * f[j, 13]
                            + velocity_var[1] * f[i, 14] * f[j, 14]
                            + velocity_var[2] * f[i, 15] * f[j, 15])
    for i in range(10):
        for j in range(i):
            block[j, i] = block[i, j]
    return top, block


def _propagate_as_arrays(
    f: Array, p: Array, angle_var: float, velocity_var: Array,
) -> tuple[Array, Array]:
    top = f @ p
    block = top @ f.T
    angle, velocity = f[0:4, 10:13], f[4:7, 13:16]
    block[0:4, 0:4] += angle_var * (angle @ angle.T)
    block[4:7, 4:7] += (velocity * velocity_var) @ velocity.T
    return top, 0.5 * (block + block.T)


propagate = _propagate_by_element if COMPILED else _propagate_as_arrays
"""F P (10, 24) and the symmetric F P F' + G Q G' (10, 10) of f (10, 24), with and without the
zeros of F. G is minus the bias columns of F: biases act on the same increments as the noise, whose
variances are angle_var rad^2 and velocity_var (3,) (m/s)^2."""


@kernel
def _replace_top_by_element(p: Array, top: Array, block: Array) -> None:
    for i in range(10):
        for j in range(10):
            p[i, j] = block[i, j]
        for j in range(10, 24):
            p[i, j] = p[j, i] = top[i, j]


def _replace_top_as_arrays(p: Array, top: Array, block: Array) -> None:
    p[0:10, 0:10] = block
    p[0:10, 10:24] = top[:, 10:24]
    p[10:24, 0:10] = top[:, 10:24].T


replace_top = _replace_top_by_element if COMPILED else _replace_top_as_arrays
"""Write the block (10, 10) and what the first states share with the others, top (10, 24), to P."""


@kernel
def advance_covariance(
    p: Array, x: Array, imu: Array, limits: Array, process: NDArray[np.void], dt_avg: float,
) -> None:
    """Propagate P over one filter period of nominal length and limit it, in place.

    process: one PROCESS; the rest as in predict_covariance. dt_avg mean filter period in s.
    """
    s = process[0]
    noise = s['noise']
    height_rate = s['height_rate']
    height_rate += NOMINAL_PERIOD / HEIGHT_RATE_TIME * (x[6] - height_rate)
    s['height_rate'] = height_rate
    if limits[WIND_ACTIVE] != 0.0:
        growth = 1.0 + WIND_NOISE_BY_HEIGHT_RATE * abs(height_rate)
        noise[22:24] = (s['wind_noise'] * growth) ** 2
    predict_covariance(p, s['transition'], x, imu, s['angle_var'], s['velocity_var'], noise,
                       limits, s['saved'])
    if s['position_drift_var'] > 0.0:
        drift = s['position_drift_var'] * min(math.hypot(x[4], x[5]), DRIFT_SPEED)
        p[7, 7] += drift
        p[8, 8] += drift
    if s['yaw_drift_var'] > 0.0:
        add_yaw_variance(p, x, s['yaw_drift_var'])
    limits[ACCEL_BIAS_VARIANCE_MAX] = (0.1 * GRAVITY * dt_avg) ** 2
    limit_covariance(p, limits)


@kernel
def add_yaw_variance(p: Array, x: Array, variance: float) -> None:
    """Add variance in rad^2 about the earth's vertical to the attitude of x (24,)."""
    q0, q1, q2, q3 = four(x)
    direction = (-0.5 * q3, -0.5 * q2, 0.5 * q1, 0.5 * q0)
    for i in range(4):
        for j in range(4):
            p[i, j] += variance * (direction[i] * direction[j])


@kernel
def predict_covariance(
    p: Array, f: Array, x: Array, imu: Array, angle_var: float, velocity_var: Array, noise: Array,
    limits: Array, saved: Array,
) -> None:
    """P <- F P F' + G Q G' + N in place.

    p (24, 24); f (10, 24) scratch, zero where fill_transition does not write; x (24,) the
    predicted state; imu (8,) the raw increments; angle_var rad^2 and velocity_var (3,) (m/s)^2 of
    the increments; noise (24,) the additive process noise; limits (6,) see kernels.update. The
    accelerometer axes whose bias is not estimated keep the saved (3,) variance and no correlation
    with states 0 to 15 (that with field and wind survives, as in the reference filter). Inactive
    magnetic and wind blocks are zero.
    """
    fill_transition(x[0:4], imu[0:3] - x[10:13], imu[3:6] - x[13:16], NOMINAL_PERIOD, f)
    top, block = propagate(f, p, angle_var, velocity_var)
    if p[7, 7] + p[8, 8] > POSITION_LOST_VARIANCE:
        top[7:9, 10:24] = p[7:9, 10:24]
        block[7:9, :] = p[7:9, 0:10]
        block[:, 7:9] = p[0:10, 7:9]
    replace_top(p, top, block)
    for i in range(7, 16):
        p[i, i] += noise[i]
    if limits[MAG_ACTIVE] != 0.0:
        _add_unless_learned(p, noise, 16, 3, FIELD_LEARNED_VARIANCE)
        _add_unless_learned(p, noise, 19, 3, FIELD_LEARNED_VARIANCE)
    if limits[WIND_ACTIVE] != 0.0:
        _add_unless_learned(p, noise, 22, 2, WIND_LEARNED_VARIANCE)
    for k in range(3):
        if limits[k] != 0.0:
            p[13 + k, 0:16] = 0.0
            p[0:16, 13 + k] = 0.0
            p[13 + k, 13 + k] = saved[k]
