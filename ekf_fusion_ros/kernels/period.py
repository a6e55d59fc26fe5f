"""One filter period at the horizon, from the raw inertial samples to the predicted state and P."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.kernels.inertial import take_imu
from ekf_fusion_ros.kernels.output import correct_predictor
from ekf_fusion_ros.kernels.output import propagate_predictor
from ekf_fusion_ros.kernels.prediction import NOMINAL_PERIOD
from ekf_fusion_ros.kernels.prediction import advance_covariance
from ekf_fusion_ros.kernels.prediction import limit_state
from ekf_fusion_ros.kernels.prediction import predict_state
from ekf_fusion_ros.kernels.yaw_bank import advance_bank

Array = NDArray[np.float64]
Record = NDArray[np.void]

TAKEN, COMPLETE, NOT_FINITE = 0, 1, 2
"""What becomes of a raw sample."""

OBSERVABLE_COS = 0.8
"""Share of gravity along an accelerometer axis from which its bias shows at rest."""


@kernel
def take_raw(
    inertial: Record, output: Record, x: Array, time_us: int, delta_angle: Array,
    delta_velocity: Array, angle_dt: float, velocity_dt: float, dt_avg: float, in_air: bool,
) -> int:
    """Take a raw sample; unless it completes a filter period, carry the output over it.

    dt_avg mean filter period in s. The output of a sample that completes a period waits for the
    update of the filter (finish_period). Returns COMPLETE where it did, TAKEN where not, and
    NOT_FINITE, with nothing done, for numbers that are not; see take_imu and propagate_predictor.
    """
    total = angle_dt + velocity_dt
    for i in range(3):
        total += delta_angle[i] + delta_velocity[i]
    if not math.isfinite(total):
        return NOT_FINITE
    raw = inertial[0]['raw']
    raw[0:3] = delta_angle
    raw[3:6] = delta_velocity
    raw[6], raw[7] = angle_dt, velocity_dt
    if take_imu(inertial, time_us, in_air):
        return COMPLETE
    propagate_predictor(output, raw, x, inertial[0]['mean_dt'][0] / dt_avg)
    return TAKEN


@kernel
def predict(
    x: Array, p: Array, rot: Array, imu: Array, earth_rate: Array, limits: Array,
    process: Record, dt_avg: float, in_air: bool, inhibit_all: bool, clipped: int,
) -> tuple[float, float, bool]:
    """Predict state and P over imu (8,); x (24,), p (24, 24) and rot (3, 3) in place.

    process one PROCESS; dt_avg mean filter period in s so far; clipped has bit k set where
    accelerometer axis k has clipped. Returns the new mean filter period, the accelerometer bias
    along the vertical in m/s, and whether any accelerometer bias is learned.
    """
    s = process[0]
    north, east = float(x[7]), float(x[8])
    predict_state(x, rot, imu, earth_rate, s['accel_lpf'])
    s['travel'][0] += x[7] - north
    s['travel'][1] += x[8] - east
    limit_state(x, dt_avg, s['accel_bias_limit'])
    select_accel_biases(p, rot, imu, limits, process, in_air, inhibit_all, clipped)
    mean_dt = float(0.5 * (imu[6] + imu[7]))
    mean_dt = min(max(mean_dt, 0.5 * NOMINAL_PERIOD), 2.0 * NOMINAL_PERIOD)
    dt_avg = 0.99 * dt_avg + 0.01 * mean_dt
    advance_covariance(p, x, imu, limits, process, dt_avg)
    down_bias = x[13] * rot[2, 0] + x[14] * rot[2, 1] + x[15] * rot[2, 2]
    learned = limits[0] + limits[1] + limits[2] < 3.0
    return dt_avg, down_bias, learned


@kernel
def select_accel_biases(
    p: Array, rot: Array, imu: Array, limits: Array, process: Record, in_air: bool,
    inhibit_all: bool, clipped: int,
) -> None:
    """Freeze the accelerometer biases that cannot be learned now, keeping their variances.

    None is learned in violent motion, on axes that have clipped, and on the ground on axes along
    which gravity does not show it.
    """
    s = process[0]
    peaks = s['peaks']
    rate = math.sqrt(imu[0] ** 2 + imu[1] ** 2 + imu[2] ** 2) / NOMINAL_PERIOD
    force = math.sqrt(imu[3] ** 2 + imu[4] ** 2 + imu[5] ** 2) / NOMINAL_PERIOD
    peaks[0] = max(rate, s['peak_decay'] * peaks[0])
    peaks[1] = max(force, s['peak_decay'] * peaks[1])
    violent = peaks[0] > s['peak_limits'][0] or peaks[1] > s['peak_limits'][1]
    for k in range(3):
        hidden = not in_air and abs(rot[2, k]) <= OBSERVABLE_COS
        freeze = inhibit_all or violent or (clipped >> k) & 1 == 1 or hidden
        if freeze and limits[k] == 0.0:
            s['saved'][k] = p[13 + k, 13 + k]
            limits[k] = 1.0
        elif not freeze and limits[k] != 0.0:
            p[13 + k, 13 + k] = s['saved'][k]
            limits[k] = 0.0


@kernel
def finish_period(
    inertial: Record, output: Record, history: Array, x: Array, dt_avg: float, delay: float,
    bank: Record, imu: Array, airspeed: float,
) -> None:
    """Carry the output over the raw sample of one INERTIAL that completed the period.

    Then correct it, see correct_predictor. The models of the yaw bank, one BANK, advance over the
    period imu (8,) at the horizon.
    """
    raw, dt_imu_avg = inertial[0]['raw'], inertial[0]['mean_dt'][0]
    propagate_predictor(output, raw, x, dt_imu_avg / dt_avg)
    correct_predictor(output, history, x, dt_imu_avg, dt_avg, delay)
    advance_bank(bank, imu, airspeed)
