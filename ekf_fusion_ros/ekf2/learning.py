"""When accelerometer biases may be learned, and when what was learned is implausible."""

from __future__ import annotations

import numpy as np

from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.state import FILTER_PERIOD
from ekf_fusion_ros.ekf2.state import SECOND

OBSERVABLE_COS = 0.8
INCONSISTENT_US = 7 * SECOND


class AccelBiasLearning:
    """Inhibits the bias states in violent motion, on unobservable axes and while clipping."""

    def __init__(self, f: Filter) -> None:
        """Act on a filter."""
        self._f = f
        self.peaks = np.zeros(2)
        self.decay = 1.0 - FILTER_PERIOD / f.params.imu.accel_bias_learn_time
        self._consistent_us = 0

    def step(self) -> None:
        """Decide for each axis; once per filter period, before the covariance prediction."""
        f = self._f
        imu = f.params.imu
        violent = (self.peaks[0] > imu.accel_bias_learn_gyro_limit
                   or self.peaks[1] > imu.accel_bias_learn_accel_limit)
        inhibit_all = imu.inhibit_accel_bias or violent or f.faults.accel_vertical
        f.faults.accel_clipping = any(f.imu.clipping)
        if inhibit_all:
            f.cov.inhibit_accel_bias((True, True, True))
        elif f.flags.in_air:
            f.cov.inhibit_accel_bias(f.imu.clipping)
        else:
            tilt = f.rot[2].tolist()
            x, y, z = (clipped or abs(cosine) <= OBSERVABLE_COS
                       for clipped, cosine in zip(f.imu.clipping, tilt, strict=True))
            f.cov.inhibit_accel_bias((x, y, z))

    def check_consistency(self) -> None:
        """Forget a bias that both vertical velocity and height have opposed for 7 s."""
        f = self._f
        if f.cov.inhibited.all():
            return
        down_bias = float(f.x[13:16].dot(f.rot[2]))
        limit = 0.9 * f.params.imu.accel_bias_limit * f.dt_avg
        if abs(down_bias) <= limit or not self._opposed(down_bias):
            f.faults.accel_bias = False
            self._consistent_us = f.t_now
            return
        f.faults.accel_bias = True
        if f.late(self._consistent_us, INCONSISTENT_US):
            f.cov.decorrelate(13, 3)
            self._consistent_us = f.t_now
            f.faults.accel_bias = False
            f.events.add(f.t_now, EventKind.ACCEL_BIAS_RESET)

    def _opposed(self, down_bias: float) -> bool:
        seen, flags = self._f.observations, self._f.flags
        by_velocity = ((flags.gps and down_bias * seen.gps_ver_vel.innovation[0] < 0.0)
                       or (flags.ev_vel and down_bias * seen.ev_ver_vel.innovation[0] < 0.0))
        by_height = (
            (flags.baro_hgt and down_bias * seen.baro_height.innovation[0] < 0.0)
            or (flags.gps_hgt and down_bias * seen.gps_height.innovation[0] < 0.0)
            or (flags.ev_hgt and down_bias * seen.ev_height.innovation[0] < 0.0))
        return by_velocity and by_height
