"""Inertial increments: down-sampling to the filter rate and vibration metrics."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.kernels.compile import three
from ekf_fusion_ros.mathlib.rotation import exponential
from ekf_fusion_ros.mathlib.rotation import rotate
from ekf_fusion_ros.mathlib.rotation import rotation_vector_from_quat

Array = NDArray[np.float64]

TARGET_DT = np.float32(10.0) * np.float32(0.001)
"""Filter period in s. Single precision: which raw sample completes a filter period hangs on
ties of this sum, and agreement with the reference filter needs the same ties."""

INERTIAL = np.dtype([
    ('quat', 'f8', (4,)), ('velocity', 'f8', (3,)), ('clock', 'f4', (2,)), ('sums', 'f8', (1,)),
    ('period', 'f8', (8,)), ('raw', 'f8', (8,)), ('previous', 'f8', (6,)),
    ('vibration', 'f8', (3,)), ('limits', 'f8', (3,)), ('mean_dt', 'f8', (1,)),
    ('times', 'i8', (3,))])
"""What down-sampling and vibration metrics keep between raw samples; the last complete period and
the newest raw sample, each delta angle (3), delta velocity (3) and both intervals; the limits of
rest: angle vibration in rad, velocity vibration in m/s, rate in rad/s; mean interval of raw
samples in s; times of the last sample, motion and vibration in us."""

LAST, LAST_MOTION, LAST_VIBRATION = 0, 1, 2
"""Entries of `times`."""

DT_MIN = 1e-4
DT_MAX = 0.02

ADJUST_GAIN = np.float32(0.01)
ADJUST_LIMIT = TARGET_DT / np.float32(2.0)


@kernel
def accumulate_imu(
    delta_angle: Array, delta_velocity: Array, angle_dt: float, velocity_dt: float,
    quat: Array, velocity: Array, clock: NDArray[np.float32], sums: Array, out: Array,
) -> bool:
    """Add one raw sample; True when `out` (8,) holds a complete filter period.

    quat (4,) and velocity (3,) accumulate rotation and velocity in the newest body frame; clock
    (2,) float32 holds the collected time and its adjustment; sums (1,) the velocity interval. out
    is delta angle (3), delta velocity (3) and their intervals. The velocity of one sample is taken
    to act half way through its rotation, which removes the sculling error to first order
    (P. G. Savage, "Strapdown inertial navigation integration algorithm design", 1998).
    """
    a0, a1, a2 = three(delta_angle)
    w, x, y, z = exponential(a0, a1, a2)
    rotate(quat, w, x, y, z)
    # v' = R(step)^T v, by the vector part of the quaternion
    x, y, z = -x, -y, -z
    for turn in range(2):
        if turn == 0:
            vx, vy, vz = three(velocity)
        else:
            vx, vy, vz = three(delta_velocity)
        tx = 2.0 * (y * vz - z * vy)
        ty = 2.0 * (z * vx - x * vz)
        tz = 2.0 * (x * vy - y * vx)
        rx = vx + w * tx + y * tz - z * ty
        ry = vy + w * ty + z * tx - x * tz
        rz = vz + w * tz + x * ty - y * tx
        if turn == 0:
            velocity[0], velocity[1], velocity[2] = rx, ry, rz
        else:
            velocity[0] += 0.5 * (vx + rx)
            velocity[1] += 0.5 * (vy + ry)
            velocity[2] += 0.5 * (vz + rz)
    clock[0] += np.float32(angle_dt)
    sums[0] += velocity_dt
    if clock[0] < TARGET_DT - clock[1]:
        return False
    adjusted = clock[1] + ADJUST_GAIN * (clock[0] - TARGET_DT)
    clock[1] = min(max(adjusted, -ADJUST_LIMIT), ADJUST_LIMIT)
    out[0:3] = rotation_vector_from_quat(quat)
    out[3:6] = velocity
    out[6] = clock[0]
    out[7] = sums[0]
    quat[:] = 0.0
    quat[0] = 1.0
    velocity[:] = 0.0
    clock[0] = 0.0
    sums[0] = 0.0
    return True


@kernel
def take_imu(
    state: NDArray[np.void], time_us: int, in_air: bool,
) -> bool:
    """Run update_vibration and accumulate_imu on the raw sample of one INERTIAL.

    Motion is any flight, vibration or turn beyond the limits of rest. True where the sample
    completed a filter period.
    """
    s = state[0]
    metrics, limits, times = s['vibration'], s['limits'], s['times']
    raw = s['raw']
    delta_angle, delta_velocity = raw[0:3], raw[3:6]
    dt = min(max(1e-6 * (time_us - times[LAST]), DT_MIN), DT_MAX)
    times[LAST] = time_us
    s['mean_dt'][0] = 0.8 * s['mean_dt'][0] + 0.2 * dt
    update_vibration(delta_angle, delta_velocity, s['previous'], metrics)
    ax, ay, az = three(delta_angle)
    turned = math.sqrt(ax * ax + ay * ay + az * az)
    if metrics[1] > limits[0] or metrics[2] > limits[1] or turned > limits[2] * dt:
        times[LAST_MOTION] = time_us
        times[LAST_VIBRATION] = time_us
    elif in_air:
        times[LAST_MOTION] = time_us
    return accumulate_imu(delta_angle, delta_velocity, raw[6], raw[7], s['quat'], s['velocity'],
                          s['clock'], s['sums'], s['period'])


@kernel
def update_vibration(
    delta_angle: Array, delta_velocity: Array, previous: Array, metrics: Array,
) -> None:
    """Low-pass coning |a x a'|, |a - a'| (rad) and |v - v'| (m/s) of successive samples.

    previous (6,) holds the sample before, metrics (3,) the filtered values.
    """
    ax, ay, az = three(delta_angle)
    bx, by, bz = three(previous)
    dx, dy, dz = three(delta_velocity)
    ex, ey, ez = three(previous[3:6])
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    coning = math.sqrt(cx * cx + cy * cy + cz * cz)
    angle = math.sqrt((ax - bx) ** 2 + (ay - by) ** 2 + (az - bz) ** 2)
    velocity = math.sqrt((dx - ex) ** 2 + (dy - ey) ** 2 + (dz - ez) ** 2)
    metrics[0] = 0.99 * metrics[0] + 0.01 * coning
    metrics[1] = 0.99 * metrics[1] + 0.01 * angle
    metrics[2] = 0.99 * metrics[2] + 0.01 * velocity
    for i in range(3):
        previous[i] = delta_angle[i]
        previous[3 + i] = delta_velocity[i]
