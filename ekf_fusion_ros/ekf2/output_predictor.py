"""Carries the delayed filter state forward to the newest IMU sample."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import machine_code
from ekf_fusion_ros.kernels.navigation import SIZE
from ekf_fusion_ros.kernels.navigation import navigation
from ekf_fusion_ros.kernels.output import OUTPUT
from ekf_fusion_ros.kernels.output import propagate_predictor
from ekf_fusion_ros.kernels.period import finish_period
from ekf_fusion_ros.mathlib.rotation import cross
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.params.ekf2 import OutputParams

if TYPE_CHECKING:
    from ekf_fusion_ros.ekf2.filter import Filter
    from ekf_fusion_ros.ekf2.yaw_estimator import YawEstimator

Array = NDArray[np.float64]
Record = NDArray[np.void]


class OutputPredictor:
    """Strapdown at full IMU rate that tracks the filter through its own delayed history.

    The attitude error against the filter at the horizon is spread over the delay; velocity and
    position errors move the whole history by a proportional-integral law.
    """

    def __init__(self, params: OutputParams, history: int) -> None:
        """Keep as many periods of history as the fusion horizon is delayed."""
        self.state = np.zeros(1, OUTPUT)
        output = self.state[0]
        output['taus'] = params.vel_tau, params.pos_tau
        self.now: Array = output['now']
        self.now[0] = 1.0
        self.rot: Array = output['rot']
        self.rate: Array = output['rate']
        self.acceleration: Array = output['acceleration']
        self.yaw: Array = output['yaw']
        self.tracking_error: Array = output['tracking_error']
        self._history = np.zeros((history, 10))
        self._finish_period = machine_code(finish_period)
        self._navigation = machine_code(navigation)

    def align(self, x: Array) -> None:
        """Start from the filter state (24,)."""
        self._history[:] = x[0:10]
        self.now[:] = x[0:10]
        self.state['running'] = True

    def propagate(self, inertial: Record, x: Array, dt_avg: float) -> None:
        """Advance by the raw sample of one INERTIAL, which completes no filter period."""
        newest = inertial[0]
        propagate_predictor(self.state, newest['raw'], x, newest['mean_dt'].item(0) / dt_avg)

    def finish_period(
        self, inertial: Record, f: Filter, delay: float, bank: YawEstimator, airspeed: float,
    ) -> None:
        """Advance by the raw sample of one INERTIAL, which completes a period, and compare.

        The state of the filter lies `delay` s in the past. The yaw bank advances by the period at
        the horizon; airspeed m/s, 0 = unknown.
        """
        self._finish_period(inertial, self.state, self._history, f.x, f.dt_avg, delay,
                            bank.models, f.imu.increments, airspeed)

    def navigation(self, x: Array, p: Array, dt_avg: float) -> Array:
        """Return (67,) what `kernels.navigation` makes of the output, states and covariance."""
        row = np.empty(SIZE)
        self._navigation(self.state, x, p, dt_avg, row)
        return row

    def velocity_at_origin(self, imu_position: Array) -> Array:
        """Return the velocity (3,) of the body origin, given the IMU position (3,) in the body."""
        velocity: Array = self.now[4:7] - self.rot @ cross(self.rate, imu_position)
        return velocity

    def position_at_origin(self, imu_position: Array) -> Array:
        """Return the position (3,) of the body origin, given the IMU position (3,) in the body."""
        position: Array = self.now[7:10] - self.rot @ imu_position
        return position

    def rotate(self, delta: Array) -> None:
        """Turn the whole history by an earth-frame quaternion (4,), as a reset does."""
        for row in self._history:
            row[0:4] = quat_multiply(delta, row[0:4])
        self.now[0:4] = quat_multiply(delta, self.now[0:4])

    def shift(self, first: int, delta: Array) -> None:
        """Add to the entries of velocity (first = 4..6) or position (7..9), as a reset does."""
        last = first + len(delta)
        self._history[:, first:last] += delta
        self.now[first:last] += delta
