"""EKF-GSF: a bank of yaw hypotheses that find north from inertial data and GNSS velocity."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.prediction import GRAVITY
from ekf_fusion_ros.kernels.yaw_bank import BANK
from ekf_fusion_ros.kernels.yaw_bank import MODELS
from ekf_fusion_ros.kernels.yaw_bank import TILT_GAIN
from ekf_fusion_ros.kernels.yaw_bank import advance_bank
from ekf_fusion_ros.kernels.yaw_bank import combine_models
from ekf_fusion_ros.kernels.yaw_bank import correct_models
from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.mathlib.rotation import with_yaw

Array = NDArray[np.float64]

WEIGHT_FLOOR = 1e-5
UNKNOWN_YAW = 0.0, (0.5 * math.pi) ** 2
FORCE_MIN, FORCE_MAX = 0.9 * GRAVITY, 1.1 * GRAVITY
"""Specific force in m/s^2 between which gravity tells the tilt."""


class YawEstimator:
    """Five attitude references with evenly spaced yaw, each with a 3-state velocity-yaw EKF.

    Their weights follow the likelihood of the velocity innovations; yaw and variance are those of
    the weighted sum.
    """

    def __init__(self) -> None:
        """Wait for a quiet moment to find the tilt."""
        self.models = np.zeros(1, BANK)
        models = self.models[0]
        self.rot: Array = models['rot']
        self.rot[:] = np.eye(3)
        self.bias: Array = models['bias']
        self.state: Array = models['state']
        self.cov: Array = models['cov']
        self.weights: Array = models['weights']
        self.weights[:] = 1.0 / MODELS
        self._accel: Array = models['accel']
        self._tilt_aligned = False
        self._running = False
        self._velocity: Array | None = None
        self._accuracy = 0.0

    def restart(self) -> None:
        """Find tilt and yaw anew."""
        self._tilt_aligned = False
        self.models['tilt_aligned'] = False
        self._run(False)

    def set_velocity(self, velocity: Array, accuracy: float) -> None:
        """Offer a NE velocity (2,) and its 1-sigma accuracy, m/s, to the next step."""
        self._velocity = velocity[0:2].copy()
        self._accuracy = accuracy

    def step(self, imu: Array, airborne: bool, airspeed: float, x: Array, dt: float) -> None:
        """Advance by one filter period and correct; airspeed m/s, 0 = unknown."""
        advance_bank(self.models, imu, airspeed)
        self.correct(imu, airborne, x, dt)

    def correct(self, imu: Array, airborne: bool, x: Array, dt: float) -> None:
        """Find the tilt, or use the velocity that is offered; after each advance of the models.

        imu (8,) raw increments; x (24,) the state of the main filter, with whose gyro bias, per
        period of dt s, the references start.
        """
        if not self._tilt_aligned:
            self._align_tilt(imu)
            return
        velocity, self._velocity = self._velocity, None
        if not airborne:
            if self._running:
                self._run(False)
        elif velocity is not None:
            self._use(velocity, x[10:13] / dt)

    @property
    def running(self) -> bool:
        """True while the filters of the models run."""
        return self._running

    def _run(self, running: bool) -> None:
        self._running = running
        self.models['running'] = running

    @property
    def yaw(self) -> float:
        """Yaw of the weighted sum in rad."""
        return self._combined()[0]

    @property
    def variance(self) -> float:
        """Variance of the weighted sum in rad^2."""
        return self._combined()[1]

    def _combined(self) -> tuple[float, float]:
        if not self._running:
            return UNKNOWN_YAW
        combined: tuple[float, float] = combine_models(self.state, self.cov, self.weights)
        return combined

    def _align_tilt(self, imu: Array) -> None:
        delta_velocity, dt = imu[3:6], max(float(imu[7]), 1e-3)
        share = min(10.0 * dt * TILT_GAIN, 1.0)
        self._accel[:] = self._accel * (1.0 - share) + delta_velocity / dt * share
        norm = float(np.linalg.norm(delta_velocity)) / dt
        if not FORCE_MIN < norm < FORCE_MAX:
            return
        down = -delta_velocity / np.linalg.norm(delta_velocity)
        # any horizontal axis will do; forward is none where the nose points up or down
        forward = np.array((1.0, 0.0, 0.0) if abs(down[0]) < 0.999 else (0.0, 1.0, 0.0))
        north = forward - down * (forward @ down)
        north /= np.linalg.norm(north)
        self.rot[:] = np.vstack((north, np.cross(down, north), down))
        self._tilt_aligned = True
        self.models['tilt_aligned'] = True

    def _use(self, velocity: Array, gyro_bias: Array) -> None:
        if not self._running:
            self._start(velocity, gyro_bias)
            return
        density = np.zeros(MODELS)
        if not correct_models(self.rot, self.state, self.cov, velocity, self._accuracy, density):
            return
        self.weights *= density
        floored = self.weights < WEIGHT_FLOOR
        if floored.all():
            self._reset_models(velocity)
            self._run(False)
            return
        self.weights[floored] = WEIGHT_FLOOR
        self.weights /= self.weights.sum()

    def _start(self, velocity: Array, gyro_bias: Array) -> None:
        self._reset_models(velocity)
        for m in range(MODELS):
            self.rot[m] = with_yaw(self.rot[m], wrap_pi(float(self.state[m, 2])))
        self.bias[:] = gyro_bias
        self._run(True)

    def _reset_models(self, velocity: Array) -> None:
        spacing = 2.0 * math.pi / MODELS
        self.weights[:] = 1.0 / MODELS
        self.state[:, 0:2] = velocity
        self.state[:, 2] = -math.pi + spacing * (np.arange(MODELS) + 0.5)
        self.cov[:] = 0.0
        self.cov[:, 0, 0] = self.cov[:, 1, 1] = self._accuracy ** 2
        self.cov[:, 2, 2] = (0.5 * spacing) ** 2
