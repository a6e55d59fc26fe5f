"""When what was learned of the accelerometer biases is implausible."""

from __future__ import annotations

from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.state import SECOND

INCONSISTENT_US = 7 * SECOND


class AccelBiasCheck:
    """Forgets an accelerometer bias that the aiding contradicts."""

    def __init__(self, f: Filter) -> None:
        """Act on a filter."""
        self._f = f
        self._consistent_us = 0

    def step(self, down_bias: float) -> None:
        """Forget a vertical bias (m/s a period) that velocity and height have opposed for 7 s."""
        f = self._f
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
