"""A lapse of the inertial data: what the vehicle did meanwhile is not known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.delayed_imu import DelayedImu
from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.state import PN
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.ekf2.state import VN
from ekf_fusion_ros.ekf2.yaw_estimator import YawEstimator

Array = NDArray[np.float64]

LAPSE = 0.5
"""Time in s without inertial data above which the filter doubts what it knew before."""

LAPSE_US = round(LAPSE * SECOND)

TILT_RATE, TILT_MAX = 0.2, 0.3
"""1-sigma rate in rad/s at which tilt wanders off, and the tilt in rad that vehicles keep to."""

YAW_RATE, YAW_MAX = 0.5, 1.0
ACCELERATION = 3.0
"""1-sigma acceleration in m/s^2 over a lapse; a vehicle is taken to keep its velocity."""


class InertialLapse:
    """Lets state and covariance follow where time has passed without inertial data.

    `ahead`: seconds of a lapse that lies between the fusion horizon and now, else 0.
    """

    def __init__(self, f: Filter, resets: Resets, bank: YawEstimator) -> None:
        """Act on a filter through its resets, and on the bank of yaw hypotheses."""
        self._f = f
        self._resets = resets
        self._bank = bank
        self._horizon_us: int | None = None
        self._now_us = 0
        self.ahead = 0.0

    def step(self, newest: DelayedImu) -> None:
        """Run once per filter period, after the prediction; newest: the period that ends now."""
        f = self._f
        horizon_us, self._horizon_us = self._horizon_us, f.t_horizon
        now_us, self._now_us = self._now_us, f.t_now
        if horizon_us is None or not f.params.imu.doubt_lapses:
            return
        if f.t_now - now_us > LAPSE_US:
            lapse = _uncovered(f.t_now - now_us, newest)
            self.ahead = lapse if lapse > LAPSE else 0.0
        if f.t_horizon - horizon_us > LAPSE_US:
            self.ahead = 0.0
            lapse = _uncovered(f.t_horizon - horizon_us, f.imu)
            if lapse > LAPSE:
                f.events.add(f.t_now, EventKind.INERTIAL_LAPSE, f'{lapse:.1f} s')
                self._coast(lapse)
                self._doubt_attitude(lapse)

    def _coast(self, lapse: float) -> None:
        """Go on at the velocity of before, which becomes uncertain."""
        f, resets = self._f, self._resets
        velocity, variances = f.x[VN:VN + 3].copy(), f.cov.p.diagonal()[VN:PN + 3].copy()
        variances += _growth(lapse, variances[:3])
        place = f.x[PN:PN + 3] + lapse * velocity
        resets.horizontal_position(place, variances[3:])
        resets.vertical_position(float(place[2]), float(variances[5]))
        resets.horizontal_velocity(velocity, variances)
        resets.vertical_velocity(float(velocity[2]), float(variances[2]))

    def _doubt_attitude(self, lapse: float) -> None:
        """Let tilt and yaw be uncertain; a magnetometer in use tells yaw anew."""
        f = self._f
        tilt, yaw = _attitude_variances(lapse)
        f.cov.decorrelate_attitude()
        f.cov.set_attitude(f.x[0:4], np.full(3, tilt))
        f.cov.add_yaw_variance(f.x[0:4], yaw)
        f.yaw_reset_requested |= f.flags.mag_hdg or f.flags.mag_3d
        self._bank.restart()

    def widen(self, pose_cov: Array, velocity_cov: Array) -> None:
        """Add to the covariances (6, 6) and (3, 3) of the output what a lapse ahead makes of them.

        The output goes on where it was: how far the vehicle went meanwhile comes on top.
        """
        velocity = self._f.output.now[4:7]
        growth = _growth(self.ahead, velocity_cov.diagonal())
        tilt, yaw = _attitude_variances(self.ahead)
        velocity_cov.ravel()[::4] += growth[:3]
        pose_cov.ravel()[::7] += (*growth[3:] + (self.ahead * velocity) ** 2, tilt, tilt,
                                  tilt + yaw)


def _uncovered(elapsed_us: int, imu: DelayedImu) -> float:
    """Return the seconds between two periods that the later one does not cover."""
    return elapsed_us / SECOND - float(imu.increments[6])


def _growth(lapse: float, velocity_variances: Array) -> Array:
    """Return what a lapse in s adds to the variances (6,) of velocity and position."""
    accelerated = np.full(3, (ACCELERATION * lapse) ** 2)
    moved = lapse ** 2 * velocity_variances + (0.5 * ACCELERATION * lapse ** 2) ** 2
    return np.concatenate((accelerated, moved))


def _attitude_variances(lapse: float) -> tuple[float, float]:
    """Return the variances in rad^2 of tilt and of yaw beyond it after a lapse in s."""
    return min(TILT_RATE * lapse, TILT_MAX) ** 2, min(YAW_RATE * lapse, YAW_MAX) ** 2
