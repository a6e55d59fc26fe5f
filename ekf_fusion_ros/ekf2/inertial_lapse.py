"""A lapse of the inertial data: what the vehicle did meanwhile is not known."""

from __future__ import annotations

import numpy as np

from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.state import PN
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.ekf2.state import VN
from ekf_fusion_ros.ekf2.yaw_estimator import YawEstimator

LAPSE = 0.5
"""Time in s without inertial data above which the filter doubts what it knew before."""

LAPSE_US = round(LAPSE * SECOND)

TILT_RATE, TILT_MAX = 0.2, 0.3
"""1-sigma rate in rad/s at which tilt wanders off, and the tilt in rad that vehicles keep to."""

YAW_RATE, YAW_MAX = 0.5, 1.0
ACCELERATION = 3.0
"""1-sigma acceleration in m/s^2 over a lapse; a vehicle is taken to keep its velocity."""


class InertialLapse:
    """Lets state and covariance follow where time has passed without inertial data."""

    def __init__(self, f: Filter, resets: Resets, bank: YawEstimator) -> None:
        """Act on a filter through its resets, and on the bank of yaw hypotheses."""
        self._f = f
        self._resets = resets
        self._bank = bank
        self._before_us: int | None = None

    def step(self) -> None:
        """Run once per filter period, after the prediction over it."""
        f, before_us = self._f, self._before_us
        self._before_us = f.t_horizon
        if before_us is None or f.t_horizon - before_us <= LAPSE_US \
                or not f.params.imu.doubt_lapses:
            return
        lapse = (f.t_horizon - before_us) / SECOND - float(f.imu.increments[6])
        if lapse > LAPSE:
            f.events.add(f.t_now, EventKind.INERTIAL_LAPSE, f'{lapse:.1f} s')
            self._coast(lapse)
            self._doubt_attitude(lapse)

    def _coast(self, lapse: float) -> None:
        """Go on at the velocity of before, which becomes uncertain."""
        f, resets = self._f, self._resets
        velocity, variances = f.x[VN:VN + 3].copy(), f.cov.p.diagonal()[VN:PN + 3].copy()
        variances[3:] += lapse ** 2 * variances[:3] + (0.5 * ACCELERATION * lapse ** 2) ** 2
        variances[:3] += (ACCELERATION * lapse) ** 2
        place = f.x[PN:PN + 3] + lapse * velocity
        resets.horizontal_position(place, variances[3:])
        resets.vertical_position(float(place[2]), float(variances[5]))
        resets.horizontal_velocity(velocity, variances)
        resets.vertical_velocity(float(velocity[2]), float(variances[2]))

    def _doubt_attitude(self, lapse: float) -> None:
        """Let tilt and yaw be uncertain; a magnetometer in use tells yaw anew."""
        f = self._f
        tilt = min(TILT_RATE * lapse, TILT_MAX) ** 2
        yaw = min(YAW_RATE * lapse, YAW_MAX) ** 2
        f.cov.decorrelate_attitude()
        f.cov.set_attitude(f.x[0:4], np.full(3, tilt))
        f.cov.add_yaw_variance(f.x[0:4], yaw)
        f.yaw_reset_requested |= f.flags.mag_hdg or f.flags.mag_3d
        self._bank.restart()
