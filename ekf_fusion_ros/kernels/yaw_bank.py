"""Bank of attitude references and 3-state (v_N, v_E, yaw) filters of the EKF-GSF yaw estimator.

Arrays hold one entry per model: rot (n, 3, 3) body to earth, bias (n, 3) rad/s, state (n, 3),
cov (n, 3, 3), weight (n,). Complementary filter after R. Mahony et al., "Nonlinear complementary
filters on the special orthogonal group", 2008; Gaussian sum after D. Alspach and H. Sorenson,
1972.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.kernels.compile import three
from ekf_fusion_ros.kernels.prediction import GRAVITY

Array = NDArray[np.float64]

TILT_GAIN = 0.2
BIAS_GAIN = 0.04
BIAS_LIMIT = 0.05
BIAS_LEARN_RATE_MAX = 0.175
ACCEL_NOISE = 2.0
GYRO_NOISE = 0.1
VARIANCE_FLOOR = 1e-6
CLIP_SIGMA = 5.0


MODELS = 5
BANK = np.dtype([
    ('rot', 'f8', (MODELS, 3, 3)), ('bias', 'f8', (MODELS, 3)), ('state', 'f8', (MODELS, 3)),
    ('cov', 'f8', (MODELS, 3, 3)), ('weights', 'f8', (MODELS,)), ('accel', 'f8', (3,)),
    ('tilt_aligned', 'f8'), ('running', 'f8')])
"""The models, the low-passed specific force in m/s^2, whether the references have found the tilt,
and whether the filters run."""


@kernel
def advance_bank(bank: NDArray[np.void], imu: Array, airspeed: float) -> None:
    """Advance every model of one BANK over imu (8,), in place.

    Nothing is done before the tilt is known.
    """
    s = bank[0]
    if s['tilt_aligned'] == 0.0:
        return
    rot, accel = s['rot'], s['accel']
    share = min(10.0 * imu[7] * TILT_GAIN, 1.0)
    dt = max(imu[7], 1e-3)
    for i in range(3):
        accel[i] = accel[i] * (1.0 - share) + imu[3 + i] / dt * share
    norm = math.sqrt(accel[0] ** 2 + accel[1] ** 2 + accel[2] ** 2)
    # the accelerometer says less about tilt the farther it is from 1 g; a banked turn has more
    attenuation = 2.0
    if airspeed > 0.0 and norm > GRAVITY:
        attenuation = 1.0
    excess = min(attenuation * abs(norm - GRAVITY) / GRAVITY, 1.0)
    predict_attitudes(rot, s['bias'], imu, accel, TILT_GAIN * (1.0 - excess) ** 2, airspeed)
    if s['running'] != 0.0:
        predict_models(rot, s['state'], s['cov'], imu)


@kernel
def combine_models(state: Array, cov: Array, weights: Array) -> tuple[float, float]:
    """Return yaw in rad and its variance in rad^2 of the weighted sum."""
    north = east = 0.0
    for m in range(weights.shape[0]):
        north += weights[m] * math.cos(state[m, 2])
        east += weights[m] * math.sin(state[m, 2])
    yaw = math.atan2(east, north)
    variance = 0.0
    for m in range(weights.shape[0]):
        spread = (state[m, 2] - yaw + math.pi) % (2.0 * math.pi) - math.pi
        variance += weights[m] * (cov[m, 2, 2] + spread * spread)
    return yaw, variance


@kernel
def predict_attitudes(
    rot: Array, bias: Array, imu: Array, accel: Array, gain: float, airspeed: float,
) -> None:
    """Turn every rot by the delta angle of imu (8,), lean it to the filtered accel (3,)."""
    fx, fy, fz = three(accel)
    norm = math.sqrt(fx * fx + fy * fy + fz * fz)
    ix, iy, iz = three(imu)
    dt = float(imu[6])
    rate_dt = max(dt, 1e-3)
    for m in range(rot.shape[0]):
        bx, by, bz = three(bias[m])
        wx, wy, wz = ix / rate_dt - bx, iy / rate_dt - by, iz / rate_dt - bz
        tx = ty = tz = 0.0
        if gain > 0.0:
            ax, ay, az = fx, fy, fz
            if airspeed > 0.0:
                ay -= airspeed * wz
                az += airspeed * wy
            gx, gy, gz = three(rot[m, 2])
            scale = gain / norm
            tx = (gy * az - gz * ay) * scale
            ty = (gz * ax - gx * az) * scale
            tz = (gx * ay - gy * ax) * scale
        if math.sqrt(wx * wx + wy * wy + wz * wz) < BIAS_LEARN_RATE_MAX:
            step = BIAS_GAIN * dt
            bx = min(max(bx - tx * step, -BIAS_LIMIT), BIAS_LIMIT)
            by = min(max(by - ty * step, -BIAS_LIMIT), BIAS_LIMIT)
            bz = min(max(bz - tz * step, -BIAS_LIMIT), BIAS_LIMIT)
            bias[m, 0], bias[m, 1], bias[m, 2] = bx, by, bz
        dx, dy, dz = ix + (tx - bx) * dt, iy + (ty - by) * dt, iz + (tz - bz) * dt
        for i in range(3):
            a, b, c = three(rot[m, i])
            a2 = a + b * dz - c * dy
            b2 = b + c * dx - a * dz
            c2 = c + a * dy - b * dx
            unit = 1.5 - 0.5 * (a2 * a2 + b2 * b2 + c2 * c2)
            rot[m, i, 0], rot[m, i, 1], rot[m, i, 2] = a2 * unit, b2 * unit, c2 * unit


@kernel
def predict_models(rot: Array, state: Array, cov: Array, imu: Array) -> None:
    """Propagate velocity and yaw of every model with the velocity increment of imu (8,)."""
    velocity_var = (ACCEL_NOISE * imu[7]) ** 2
    yaw_var = (GYRO_NOISE * imu[6]) ** 2
    vx, vy, vz = three(imu[3:6])
    for m in range(rot.shape[0]):
        n0, n1, n2 = three(rot[m, 0])
        e0, e1, e2 = three(rot[m, 1])
        if abs(rot[m, 2, 0]) < abs(rot[m, 2, 1]):
            yaw = math.atan2(e0, n0)
        else:
            yaw = math.atan2(-n1, e1)
        dn = n0 * vx + n1 * vy + n2 * vz
        de = e0 * vx + e1 * vy + e2 * vz
        state[m, 0] += dn
        state[m, 1] += de
        state[m, 2] = yaw
        # d(dv_NE)/d(yaw) = (-de, dn): the increments rotate with the yaw error
        c00, c01, c02 = three(cov[m, 0])
        _, c11, c12 = three(cov[m, 1])
        c22 = float(cov[m, 2, 2])
        p02 = c02 - de * c22
        p12 = c12 + dn * c22
        p00 = c00 - de * (c02 + p02)
        p11 = c11 + dn * (c12 + p12)
        p01 = c01 - de * c12 + dn * p02
        cov[m, 0, 0] = max(p00 + velocity_var, VARIANCE_FLOOR)
        cov[m, 1, 1] = max(p11 + velocity_var, VARIANCE_FLOOR)
        cov[m, 2, 2] = max(c22 + yaw_var, VARIANCE_FLOOR)
        cov[m, 0, 1] = cov[m, 1, 0] = p01
        cov[m, 0, 2] = cov[m, 2, 0] = p02
        cov[m, 1, 2] = cov[m, 2, 1] = p12


@kernel
def correct_models(
    rot: Array, state: Array, cov: Array, velocity: Array, accuracy: float, density: Array,
) -> bool:
    """Fuse a NE velocity (2,) into every model; False if any S was singular.

    density (n,) receives the likelihood of the unclipped innovation. The innovation is shortened
    to 5 sigma for the state correction.
    """
    noise = max(accuracy, 0.01) ** 2
    good = True
    for m in range(rot.shape[0]):
        in_ = state[m, 0] - velocity[0]
        ie = state[m, 1] - velocity[1]
        s00 = cov[m, 0, 0] + noise
        s11 = cov[m, 1, 1] + noise
        s01 = cov[m, 0, 1]
        det = s00 * s11 - s01 * s01
        if abs(det) < 1e-6:
            good = False
            continue
        i00, i11, i01 = s11 / det, s00 / det, -s01 / det
        chi2 = i00 * in_ * in_ + 2.0 * i01 * in_ * ie + i11 * ie * ie
        density[m] = math.exp(-0.5 * chi2) / (2.0 * math.pi * math.sqrt(abs(det)))
        scale = 1.0
        if chi2 > CLIP_SIGMA ** 2:
            scale = CLIP_SIGMA / math.sqrt(chi2)
        before = cov[m].copy()
        yaw_change = 0.0
        for i in range(3):
            ki0 = before[i, 0] * i00 + before[i, 1] * i01
            ki1 = before[i, 0] * i01 + before[i, 1] * i11
            change = -(ki0 * in_ + ki1 * ie) * scale
            state[m, i] += change
            if i == 2:
                yaw_change = change
            for j in range(3):
                cov[m, i, j] = before[i, j] - ki0 * before[0, j] - ki1 * before[1, j]
        for i in range(3):
            for j in range(i):
                mean = 0.5 * (cov[m, i, j] + cov[m, j, i])
                cov[m, i, j] = cov[m, j, i] = mean
            cov[m, i, i] = max(cov[m, i, i], VARIANCE_FLOOR)
        c, s = math.cos(yaw_change), math.sin(yaw_change)
        for j in range(3):
            a, b = rot[m, 0, j], rot[m, 1, j]
            rot[m, 0, j] = a * c - b * s
            rot[m, 1, j] = a * s + b * c
    return good
