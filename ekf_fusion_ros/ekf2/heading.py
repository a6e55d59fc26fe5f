"""Fusion of a yaw angle, wherever it comes from."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.kernels.compile import machine_code
from ekf_fusion_ros.kernels.heading import compare_headings
from ekf_fusion_ros.kernels.heading import level_heading
from ekf_fusion_ros.kernels.heading import observe_yaw
from ekf_fusion_ros.kernels.heading import refresh_yaw
from ekf_fusion_ros.mathlib.angles import wrap_pi

Array = NDArray[np.float64]

YAW_NOISE_FLOOR = 1e-4
PSEUDO_YAW_NOISE = 0.01
MOVING_YAW_NOISE = 0.25
QUAT_VARIANCE_MAX = 1e-4
GROUND_SETTLING_US = 5 * SECOND


class HeadingFusion:
    """Fuses measured yaw, and holds yaw where nothing measures it."""

    def __init__(self, f: Filter) -> None:
        """Act on a filter; `covariance_lost` asks it to start P anew."""
        self._f = f
        self.last_static_yaw = 0.0
        self.covariance_lost = False
        self._jacobian = np.zeros(4)
        self._gain = np.zeros(24)
        self._compare_headings = machine_code(compare_headings)
        self._observe_yaw = machine_code(observe_yaw)

    def predicted_yaw(self) -> float:
        """Renew the cached rotation and return its yaw by the better sequence, rad."""
        yaw: float = refresh_yaw(self._f.x, self._f.rot)
        return yaw

    def fuse_measured(self, measured: float, noise: float) -> None:
        """Fuse a yaw in rad with a variance in rad^2."""
        self._fuse_against(self.predicted_yaw(), measured, noise)

    def fuse_magnetic(self, field: Array, declination: float, noise: float) -> None:
        """Fuse the yaw that a field (3,) in body axes implies; noise in rad^2."""
        predicted, magnetic = self._compare_headings(self._f.x, self._f.rot, field)
        self._fuse_against(predicted, magnetic + declination, noise)

    def _fuse_against(self, predicted: float, measured: float, noise: float) -> None:
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
        p = f.cov.p
        if sum(p.item(i, i) for i in range(4)) > QUAT_VARIANCE_MAX:
            self._fuse(0.0, MOVING_YAW_NOISE)
        else:
            self._fuse(0.0 if measured is None else wrap_pi(predicted - measured), noise)

    def _fuse(self, innovation: float, noise: float) -> None:
        f = self._f
        noise = max(noise, YAW_NOISE_FLOOR)
        known: float = self._observe_yaw(f.x, f.rot, f.cov.p, self._jacobian, self._gain)
        if math.isnan(known):
            return
        f.faults.heading = known < 0.0
        if f.faults.heading:
            self.covariance_lost = True
            return
        variance = known + noise
        innovation = self._gate(innovation, variance)
        if math.isnan(innovation):
            return
        f.faults.heading = not f.cov.fuse_yaw(f.x, self._jacobian, self._gain, variance,
                                              innovation)

    def _gate(self, innovation: float, variance: float) -> float:
        """Return the innovation to fuse, clipped on the ground; NaN where it is rejected."""
        f = self._f
        gate = max(f.params.mag.heading_gate, 1.0)
        record = f.observations.yaw
        ratio = innovation * innovation / (gate * gate * variance)
        f.observations.mag.test_ratio = 0.0
        f.rejections.yaw = ratio > 1.0
        if f.rejections.yaw:
            settled = not f.flags.in_air and f.late(f.last_in_air_us, GROUND_SETTLING_US)
            if not settled:
                record.note(f.t_now, record.innovation, (variance,), ratio, False)
                return math.nan
            # on the ground the yaw gyro bias is the likeliest cause: open it up, go on clipped
            limit = gate * math.sqrt(variance)
            innovation = min(max(innovation, -limit), limit)
            bias_variance = (f.params.imu.switch_on_gyro_bias * f.dt_avg) ** 2
            f.cov.set_variances(12, np.array((bias_variance,)))
        record.note(f.t_now, (innovation,), (variance,), ratio, True)
        return innovation


def mag_yaw(f: Filter, field_body: Array, declination: float) -> float:
    """Return the yaw in rad that a field (3,) in body axes implies at the current tilt."""
    return wrap_pi(float(level_heading(f.rot, field_body)) + declination)
