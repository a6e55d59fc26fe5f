"""The owner of P: prediction, limits, and what resets do to it."""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.delayed_imu import DelayedImu
from ekf_fusion_ros.ekf2.state import FILTER_PERIOD
from ekf_fusion_ros.ekf2.state import SIZE
from ekf_fusion_ros.kernels.body_velocity import Three
from ekf_fusion_ros.kernels.body_velocity import fuse_body_velocity
from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.kernels.compile import machine_code
from ekf_fusion_ros.kernels.heading import apply_yaw
from ekf_fusion_ros.kernels.magnetic import correct_by_field
from ekf_fusion_ros.kernels.magnetic import fuse_declination
from ekf_fusion_ros.kernels.period import predict
from ekf_fusion_ros.kernels.prediction import GRAVITY
from ekf_fusion_ros.kernels.prediction import PROCESS
from ekf_fusion_ros.kernels.prediction import add_yaw_variance
from ekf_fusion_ros.kernels.update import ACCEL_BIAS_VARIANCE_MAX
from ekf_fusion_ros.kernels.update import MAG_ACTIVE
from ekf_fusion_ros.kernels.update import WIND_ACTIVE
from ekf_fusion_ros.kernels.update import apply_update
from ekf_fusion_ros.kernels.update import fuse_state
from ekf_fusion_ros.kernels.update import fuse_two_states
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.samples import NO_CLIPPING

Array = NDArray[np.float64]

ALL_AXES = (True, True, True)
BAD_ACCEL_NOISE = 4.9
"""Accelerometer noise in m/s^2 while it clips or contradicts the height aiding."""

BAD_ACCEL_VARIANCE = (FILTER_PERIOD * BAD_ACCEL_NOISE) ** 2


class Covariance:
    """Covariance of the 24 states; nothing outside this class and its kernels writes `p`."""

    def __init__(self, params: Ekf2Params) -> None:
        """Start at zero; `initialise` gives the first values."""
        self.p: Array = np.zeros((SIZE, SIZE))
        self.limits: Array = np.zeros(6)
        self._predict = machine_code(predict)
        self._fuse_state = machine_code(fuse_state)
        self._fuse_two_states = machine_code(fuse_two_states)
        self._fuse_declination = machine_code(fuse_declination)
        self._correct_by_field = machine_code(correct_by_field)
        self._apply_yaw = machine_code(apply_yaw)
        self.inhibited: Array = self.limits[0:3]
        self._saved_ne = np.zeros((2, 2))
        self._saved_d_body = np.zeros(4)
        self._mag_active = False
        self.limits[ACCEL_BIAS_VARIANCE_MAX] = (0.1 * GRAVITY * FILTER_PERIOD) ** 2
        imu = params.imu
        self._bad_axes = NO_CLIPPING
        self._process = np.zeros(1, PROCESS)
        process = self._process[0]
        self.accel_lpf: Array = process['accel_lpf']
        self.travel: Array = process['travel']
        self._learns_no_accel_bias = imu.inhibit_accel_bias
        process['accel_bias_limit'] = imu.accel_bias_limit
        process['peak_limits'] = imu.accel_bias_learn_gyro_limit, imu.accel_bias_learn_accel_limit
        process['peak_decay'] = 1.0 - FILTER_PERIOD / imu.accel_bias_learn_time
        self._velocity_var: Array = process['velocity_var']
        self._seen_drift = math.inf
        self.set_noise(params)

    def set_noise(self, params: Ekf2Params) -> None:
        """Predict with the process noise of these parameters from now on."""
        imu, mag, process = params.imu, params.mag, self._process[0]
        dt = FILTER_PERIOD
        self._accel_var = self._stated_accel_var = (dt * min(imu.accel_noise, 1.0)) ** 2
        self._set_velocity_noise()
        process['angle_var'] = (dt * min(imu.gyro_noise, 1.0)) ** 2
        noise = process['noise']
        noise[10:13] = (dt * dt * imu.gyro_bias_process_noise) ** 2
        noise[13:16] = (dt * dt * imu.accel_bias_process_noise) ** 2
        noise[16:19] = (dt * mag.earth_process_noise) ** 2
        noise[19:22] = (dt * mag.body_process_noise) ** 2
        process['wind_noise'] = dt * params.aiding.wind_process_noise
        self._assumed_drift = params.aiding.position_drift
        self.limit_position_drift(self._seen_drift)
        process['yaw_drift_var'] = dt * params.aiding.yaw_drift ** 2

    @property
    def position_drift(self) -> float:
        """Random walk of the horizontal position in m/sqrt(m) that is reckoned with."""
        return min(self._assumed_drift, self._seen_drift)

    def limit_position_drift(self, seen: float) -> None:
        """Take the random walk in m/sqrt(m) for no more than was seen, from now on."""
        self._seen_drift = seen
        self._process[0]['position_drift_var'] = FILTER_PERIOD * self.position_drift ** 2

    def predict(
        self, x: Array, rot: Array, imu: DelayedImu, earth_rate: Array, dt_avg: float,
        in_air: bool, bad_accel: bool,
    ) -> tuple[float, float, bool]:
        """Propagate state and P over one filter period; see kernels.period.predict.

        x (24,), rot (3, 3) the rotation of x, earth_rate (3,) rad/s NED, dt_avg s; bad_accel: the
        accelerometer contradicts the height aiding.
        """
        clipping = imu.clipping
        bad_axes = ALL_AXES if bad_accel else clipping
        if bad_axes != self._bad_axes:
            self._bad_axes = bad_axes
            self._set_velocity_noise()
        clipped = 0 if clipping == NO_CLIPPING else sum(c << k for k, c in enumerate(clipping))
        outcome: tuple[float, float, bool] = self._predict(
            x, self.p, rot, imu.increments, earth_rate, self.limits, self._process, dt_avg,
            in_air, bad_accel or self._learns_no_accel_bias, clipped)
        return outcome

    def _set_velocity_noise(self) -> None:
        self._velocity_var[:] = np.where(self._bad_axes, BAD_ACCEL_VARIANCE, self._accel_var)

    def scale_accel_noise(self, factor: float) -> None:
        """Multiply the accelerometer variance, between what is stated and what clipping gets."""
        self._accel_var = min(max(self._accel_var * factor, self._stated_accel_var),
                              BAD_ACCEL_VARIANCE)
        self._set_velocity_noise()

    @property
    def mag_active(self) -> bool:
        """True while the field states are estimated."""
        return self._mag_active

    @mag_active.setter
    def mag_active(self, active: bool) -> None:
        self._mag_active = active
        self.limits[MAG_ACTIVE] = active

    @property
    def wind_active(self) -> bool:
        """True while the wind states are estimated."""
        return bool(self.limits[WIND_ACTIVE])

    @wind_active.setter
    def wind_active(self, active: bool) -> None:
        self.limits[WIND_ACTIVE] = active

    def fuse_state(
        self, x: Array, state: int, innovation: float, noise: float, gate: float,
    ) -> tuple[float, float, bool]:
        """Gate and fuse an observation of one state; see kernels.update.fuse_state."""
        outcome: tuple[float, float, bool] = self._fuse_state(
            self.p, x, state, innovation, noise, gate, self.limits)
        return outcome

    def fuse(self, x: Array, gain: Array, hp: Array, innovation: float) -> bool:
        """Correct with a gain (24,) and H P (24,); False on a numerical fault."""
        healthy: bool = apply_update(self.p, x, gain, hp, innovation, self.limits)
        return healthy

    def fuse_yaw(
        self, x: Array, jacobian: Array, gain: Array, variance: float, innovation: float,
    ) -> bool:
        """Correct with a yaw; see kernels.heading.apply_yaw."""
        healthy: bool = self._apply_yaw(
            self.p, x, jacobian, gain, variance, innovation, self.limits)
        return healthy

    def fuse_two_states(
        self, x: Array, first: int, innovation: Sequence[float], noise: Sequence[float],
        gate: float, largest_ratio: float,
    ) -> tuple[float, float, float, int]:
        """Gate and fuse two neighbouring states; see kernels.update.fuse_two_states."""
        outcome: tuple[float, float, float, int] = self._fuse_two_states(
            self.p, x, first, innovation[0], innovation[1], noise[0], noise[1], gate,
            largest_ratio, self.limits)
        return outcome

    def fuse_body_velocity(
        self, x: Array, measured: Array, noise: Array, gate: float,
    ) -> tuple[Three, Three, Three, int]:
        """Gate and fuse a velocity in body axes; see kernels.body_velocity.fuse_body_velocity."""
        outcome: tuple[Three, Three, Three, int] = fuse_body_velocity(
            self.p, x, measured, noise, gate, self.limits)
        return outcome

    def correct_by_field(
        self, x: Array, measured: Array, axes: int, noise: float, gate: float, all_states: bool,
        declination: float, shortest: float,
    ) -> tuple[bool, Three, Three, Three, tuple[int, int, int]]:
        """Gate and fuse the first magnetometer axes; see kernels.magnetic.correct_by_field."""
        outcome: tuple[bool, Three, Three, Three, tuple[int, int, int]] = self._correct_by_field(
            x, self.p, measured, axes, noise, gate, all_states, declination, shortest, self.limits)
        return outcome

    def fuse_declination(
        self, x: Array, wanted: float, noise: float, declination: float, shortest: float,
    ) -> tuple[float, float, int]:
        """Correct with the declination; see kernels.magnetic.fuse_declination."""
        outcome: tuple[float, float, int] = self._fuse_declination(
            x, self.p, wanted, noise, declination, shortest, self.limits)
        return outcome

    def decorrelate(self, first: int, size: int) -> None:
        """Remove all correlations of states first .. first + size - 1, keeping variances."""
        variances = np.diag(self.p)[first:first + size].copy()
        self.set_variances(first, variances)

    def set_variances(self, first: int, variances: Array) -> None:
        """Decorrelate states from `first` on and give them variances."""
        last = first + len(variances)
        self.p[first:last, :] = 0.0
        self.p[:, first:last] = 0.0
        for i, variance in enumerate(variances):
            self.p[first + i, first + i] = variance

    def set_block(self, first: int, block: Array) -> None:
        """Decorrelate states from `first` on and give them a covariance (n, n) of their own."""
        last = first + len(block)
        self.p[first:last, :] = 0.0
        self.p[:, first:last] = 0.0
        self.p[first:last, first:last] = block

    def decorrelate_attitude(self) -> None:
        """Remove the correlations of the quaternion with all other states."""
        self.p[0:4, 4:] = 0.0
        self.p[4:, 0:4] = 0.0

    def set_attitude(self, q: Array, variances: Array) -> None:
        """Give the quaternion the covariance of a rotation vector with variances (3,) rad^2."""
        jacobian = quat_by_rotation_vector(q)
        self.p[0:4, :] = 0.0
        self.p[:, 0:4] = 0.0
        self.p[0:4, 0:4] = jacobian @ np.diag(variances) @ jacobian.T

    def add_yaw_variance(self, q: Array, variance: float) -> None:
        """Add variance in rad^2 about the earth's vertical."""
        add_yaw_variance(self.p, q, variance)

    def activate_mag(self, active: bool) -> None:
        """Switch the field states on or off; their variances survive the pause."""
        p = self.p
        if active and not self.mag_active:
            p[16:22, :] = 0.0
            p[:, 16:22] = 0.0
            p[16:18, 16:18] = self._saved_ne
            for i in range(4):
                p[18 + i, 18 + i] = self._saved_d_body[i]
        elif not active and self.mag_active:
            self._save_field()
        self.mag_active = active

    def reset_field(self, variance: float) -> None:
        """Forget what is known of the field states."""
        self.set_variances(16, np.full(6, variance))
        if not self.mag_active:
            self._save_field()

    def _save_field(self) -> None:
        self._saved_ne = self.p[16:18, 16:18].copy()
        self._saved_d_body = np.diag(self.p)[18:22].copy()


def quat_by_rotation_vector(q: Array) -> Array:
    """Return d(quaternion)/d(rotation vector), (4, 3), at the rotation vector of q.

    From q = [cos(|r|/2), r sin(|r|/2) / |r|].
    """
    q = -q if q[0] < 0.0 else q
    vector_norm = float(np.linalg.norm(q[1:4]))
    half = math.atan2(vector_norm, q[0])
    angle = 2.0 * half
    if angle * angle <= 1e-9:
        return 0.5 * np.vstack((np.zeros(3), np.eye(3)))
    axis = q[1:4] / vector_norm
    s, c = math.sin(half), math.cos(half)
    jacobian = np.empty((4, 3))
    jacobian[0] = -0.5 * s * axis
    jacobian[1:4] = (s / angle) * np.eye(3) + np.outer(axis, axis) * (0.5 * c - s / angle)
    return jacobian


@kernel
def rotation_vector_variances(q: Array, p: Array) -> Array:
    """Return the variances (3,) rad^2 of the rotation vector of q, from the quaternion block."""
    sign = -1.0 if q[0] < 0.0 else 1.0
    q0 = sign * q[0]
    s = 1.0 - q0 * q0
    if s <= 1e-9:
        return np.array((4.0 * p[1, 1], 4.0 * p[2, 2], 4.0 * p[3, 3]))
    b = 2.0 * math.acos(q0) / math.sqrt(s)
    along = -2.0 / s + 2.0 * q0 * math.acos(q0) / s ** 1.5
    variances = np.empty(3)
    for i in range(3):
        a = along * sign * q[1 + i]
        variances[i] = a * a * p[0, 0] + 2.0 * a * b * p[0, 1 + i] + b * b * p[1 + i, 1 + i]
    return variances
