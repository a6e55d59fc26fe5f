"""When accelerometer biases may be learned, and when what was learned is implausible."""

from __future__ import annotations

import numpy as np

from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import NO_CLIPPING
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.state import FILTER_PERIOD
from ekf_fusion_ros.ekf2.state import SECOND

INCONSISTENT_US = 7 * SECOND
ALL_AXES = (True, True, True)


class AccelBiasLearning:
    """Inhibits the bias states in violent motion, on unobservable axes and while clipping."""

    def __init__(self, f: Filter) -> None:
        """Act on a filter."""
        self._f = f
        self.peaks = np.zeros(2)
        self.decay = 1.0 - FILTER_PERIOD / f.params.imu.accel_bias_learn_time
        self._consistent_us = 0

    def step(self, peak_rate: float, peak_force: float, observable: int) -> None:
        """Decide for each axis; once per filter period, before the covariance prediction.

        Peaks in rad/s and m/s^2; bit k of `observable`: gravity shows the bias of axis k.
        """
        f = self._f
        imu = f.params.imu
        violent = (peak_rate > imu.accel_bias_learn_gyro_limit
                   or peak_force > imu.accel_bias_learn_accel_limit)
        inhibit_all = imu.inhibit_accel_bias or violent or f.faults.accel_vertical
        clipping = f.imu.clipping
        f.faults.accel_clipping = clipping != NO_CLIPPING
        if inhibit_all:
            f.cov.inhibit_accel_bias(ALL_AXES)
        elif f.flags.in_air:
            f.cov.inhibit_accel_bias(clipping)
        else:
            x, y, z = (clipping[k] or not observable >> k & 1 for k in range(3))
            f.cov.inhibit_accel_bias((x, y, z))

    def check_consistency(self, down_bias: float) -> None:
        """Forget a bias (m/s a period) that velocity and height have opposed for 7 s."""
        f = self._f
        if f.cov.inhibited_axes == ALL_AXES:
            return
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
            or (flags.rng_hgt and down_bias * seen.range_height.innovation[0] < 0.0)
            or (flags.ev_hgt and down_bias * seen.ev_height.innovation[0] < 0.0))
        return by_velocity and by_height
