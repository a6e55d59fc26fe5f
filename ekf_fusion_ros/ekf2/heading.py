"""Fusion of a yaw angle, wherever it comes from."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.resets import refresh_rotation
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.mathlib.rotation import rolls_more_than_pitches
from ekf_fusion_ros.mathlib.rotation import with_yaw
from ekf_fusion_ros.mathlib.rotation import yaw_312
from ekf_fusion_ros.mathlib.rotation import yaw_321

Array = NDArray[np.float64]

YAW_NOISE_FLOOR = 1e-4
PSEUDO_YAW_NOISE = 0.01
MOVING_YAW_NOISE = 0.25
QUAT_VARIANCE_MAX = 1e-4
GROUND_SETTLING_US = 5 * SECOND


def yaw_jacobian(q: Array, sequence_321: bool) -> Array | None:
    """Return d(yaw)/d(q), (4,), of yaw = atan2(y, x); None at the singularity.

    321: y = 2(q0 q3 + q1 q2), x = q0^2 + q1^2 - q2^2 - q3^2.
    312: y = 2(q0 q3 - q1 q2), x = q0^2 - q1^2 + q2^2 - q3^2.
    """
    q0, q1, q2, q3 = q
    if sequence_321:
        y, x = 2.0 * (q0 * q3 + q1 * q2), q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3
        dy = np.array((q3, q2, q1, q0))
        dx = np.array((q0, q1, -q2, -q3))
    else:
        y, x = 2.0 * (q0 * q3 - q1 * q2), q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3
        dy = np.array((q3, -q2, -q1, q0))
        dx = np.array((q0, -q1, q2, -q3))
    if x * x <= 1e-6 and y * y <= 1e-6:
        return None
    jacobian: Array = 2.0 * (x * dy - y * dx) / (x * x + y * y)
    return jacobian


class HeadingFusion:
    """Fuses measured yaw, and holds yaw where nothing measures it."""

    def __init__(self, f: Filter) -> None:
        """Act on a filter; `covariance_lost` asks it to start P anew."""
        self._f = f
        self.last_static_yaw = 0.0
        self.covariance_lost = False

    def predicted_yaw(self) -> float:
        """Renew the cached rotation and return its yaw by the better sequence, rad."""
        refresh_rotation(self._f)
        rot = self._f.rot
        return yaw_321(rot) if rolls_more_than_pitches(rot) else yaw_312(rot)

    def fuse_measured(self, measured: float, noise: float) -> None:
        """Fuse a yaw in rad with a variance in rad^2."""
        predicted = self.predicted_yaw()
        self.last_static_yaw = predicted
        self._fuse(wrap_pi(predicted - measured), noise)

    def hold(self, measured: float | None, noise: float) -> None:
        """Keep yaw bounded while its measurement is not to be trusted.

        At rest the yaw of the moment is held. Moving, only the variance is bounded: while the
        attitude is known well enough the update is made with the measurement all the same (or with
        none, None), which is what the reference filter does.
        """
        f = self._f
        predicted = self.predicted_yaw()
        if f.flags.vehicle_at_rest:
            if abs(self.last_static_yaw) < 1e-6:
                self.last_static_yaw = predicted
            self._fuse(wrap_pi(predicted - self.last_static_yaw), noise)
            return
        self.last_static_yaw = predicted
        if float(np.trace(f.cov.p[0:4, 0:4])) > QUAT_VARIANCE_MAX:
            self._fuse(0.0, MOVING_YAW_NOISE)
        else:
            self._fuse(0.0 if measured is None else wrap_pi(predicted - measured), noise)

    def _fuse(self, innovation: float, noise: float) -> None:
        f = self._f
        noise = max(noise, YAW_NOISE_FLOOR)
        jacobian = yaw_jacobian(f.x[0:4], rolls_more_than_pitches(f.rot))
        if jacobian is None:
            return
        variance = float(jacobian @ f.cov.p[0:4, 0:4] @ jacobian) + noise
        if variance < noise:
            f.faults.heading = True
            self.covariance_lost = True
            return
        f.faults.heading = False
        gain = (f.cov.p[:, 0:4] @ jacobian) / variance
        gain[16:22] = 0.0
        if not f.flags.wind:
            gain[22:24] = 0.0
        innovation = self._gate(innovation, variance)
        if math.isnan(innovation):
            return
        hp = jacobian @ f.cov.p[0:4, :]
        f.faults.heading = not f.cov.fuse(f.x, gain, hp, innovation)

    def _gate(self, innovation: float, variance: float) -> float:
        """Return the innovation to fuse, clipped on the ground; NaN where it is rejected."""
        f = self._f
        gate = max(f.params.mag.heading_gate, 1.0)
        record = f.observations.yaw
        ratio = innovation * innovation / (gate * gate * variance)
        record.record(f.t_now, record.innovation, (variance,), ratio)
        f.observations.mag.test_ratio = 0.0
        f.rejections.yaw = ratio > 1.0
        if f.rejections.yaw:
            settled = not f.flags.in_air and f.late(f.last_in_air_us, GROUND_SETTLING_US)
            if not settled:
                record.reject()
                return math.nan
            # on the ground the yaw gyro bias is the likeliest cause: open it up, go on clipped
            limit = gate * math.sqrt(variance)
            innovation = min(max(innovation, -limit), limit)
            bias_variance = (f.params.imu.switch_on_gyro_bias * f.dt_avg) ** 2
            f.cov.set_variances(12, np.array((bias_variance,)))
        record.accept()
        record.innovation[0] = innovation
        return innovation


def mag_yaw(f: Filter, field_body: Array, declination: float) -> float:
    """Return the yaw in rad that a field (3,) in body axes implies at the current tilt."""
    level = with_yaw(f.rot, 0.0) @ field_body
    return wrap_pi(-math.atan2(level[1], level[0]) + declination)
