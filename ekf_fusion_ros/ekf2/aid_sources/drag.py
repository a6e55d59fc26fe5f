"""Drag of a multirotor: the force across the propeller axis tells the wind.

The model is that of `kernels.air_data.predict_drag`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ekf_fusion_ros.buffer import SampleBuffer
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.scalar import fuse_scalar
from ekf_fusion_ros.ekf2.wind import Wind
from ekf_fusion_ros.kernels.air_data import predict_drag
from ekf_fusion_ros.kernels.air_data import relative_wind
from ekf_fusion_ros.kernels.innovation import project
from ekf_fusion_ros.kernels.update import test_ratio
from ekf_fusion_ros.samples import ImuSample

AIR_DENSITY = 1.225
LEAST_SAMPLES = 5
"""Least number of filter periods behind one drag sample."""

GATE = 5.0
NOISE_FLOOR = 0.5
BALLISTIC_MIN = 1.0
MOMENTUM_MIN = 0.001
"""Coefficients up to which a kind of drag is not modelled."""


class DragSample(NamedTuple):
    """Mean specific force along body x and y, m/s^2."""

    x: float
    y: float


class Drag:
    """Averages the accelerometer, starts the wind states in flight, and fuses."""

    def __init__(self, f: Filter, wind: Wind, capacity: int, history: int) -> None:
        """Act on a filter and its wind states; history periods lie behind the horizon."""
        self._f = f
        self._wind = wind
        self.enabled = f.params.air_data.use_drag
        self.buffer: SampleBuffer[DragSample] = SampleBuffer(capacity)
        self._needed = max(LEAST_SAMPLES, -(-history // capacity))
        self._sum = [0.0, 0.0, 0.0]
        self._time_sum_us = 0
        self._count = 0
        self._air, self._jacobian = np.zeros(3), np.zeros((3, 24))
        self._hp, self._force = np.zeros(24), np.zeros(2)

    def add(self, imu: ImuSample) -> None:
        """Take the raw sample that completed a filter period; only where drag is enabled."""
        self._sum[0] += float(imu.delta_velocity[0])
        self._sum[1] += float(imu.delta_velocity[1])
        self._sum[2] += imu.delta_velocity_dt
        self._time_sum_us += imu.time_us
        self._count += 1
        if self._count < self._needed:
            return
        x, y, elapsed = self._sum
        self.buffer.push(self._time_sum_us // self._count, DragSample(x / elapsed, y / elapsed))
        self._sum = [0.0, 0.0, 0.0]
        self._time_sum_us = self._count = 0

    def step(self, yaw_uncertain: bool) -> None:
        """Run once per filter period; yaw_uncertain: the compass has been unusable for long."""
        f = self._f
        if not self.enabled or f.holding_position or not f.flags.in_air or yaw_uncertain:
            return
        if self._wind.start():
            return
        popped = self.buffer.pop_first_older_than(f.t_horizon)
        if popped is not None:
            self._fuse(popped[1])

    def _fuse(self, sample: DragSample) -> None:
        f = self._f
        relative_wind(f.x, self._air, self._jacobian)
        speeds = self._air.tolist()
        params = f.params.air_data
        if self._fuse_axis(0, speeds[0], sample.x, params.ballistic_coef_x):
            self._fuse_axis(1, speeds[1], sample.y, params.ballistic_coef_y)

    def _fuse_axis(self, axis: int, speed: float, force: float, ballistic: float) -> bool:
        """Judge and fuse one axis; False where P is not to be trusted."""
        f = self._f
        params, record = f.params.air_data, f.observations.drag
        momentum = params.momentum_drag_coef if params.momentum_drag_coef > MOMENTUM_MIN else 0.0
        ballistic = ballistic if ballistic > BALLISTIC_MIN else 0.0
        if not momentum and not ballistic:
            return True
        measured = force - float(f.x[13 + axis]) / f.dt_avg
        predict_drag(speed, measured, AIR_DENSITY, ballistic, momentum, self._force)
        predicted, slope = self._force.tolist()
        relative_wind(f.x, self._air, self._jacobian)
        noise = max(params.drag_noise, NOISE_FLOOR)
        variance = project(f.cov.p, -slope * self._jacobian[axis], self._hp) + noise
        if variance < noise:
            return False
        innovation = predicted - measured
        innovations, variances = list(record.innovation), list(record.variance)
        innovations[axis], variances[axis] = innovation, variance
        ratio = test_ratio(innovation, variance, GATE)
        if record.note(f.t_now, innovations, variances, ratio, ratio <= 1.0):
            fuse_scalar(f, self._hp, variance, innovation, wind_only=True)
        return True
