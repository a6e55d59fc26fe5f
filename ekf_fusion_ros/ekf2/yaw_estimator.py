"""EKF-GSF: a bank of yaw hypotheses that find north from inertial data and GNSS velocity."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.prediction import GRAVITY
from ekf_fusion_ros.kernels.yaw_bank import correct_models
from ekf_fusion_ros.kernels.yaw_bank import predict_attitudes
from ekf_fusion_ros.kernels.yaw_bank import predict_models
from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.mathlib.rotation import with_yaw

Array = NDArray[np.float64]

MODELS = 5
TILT_GAIN = 0.2
WEIGHT_FLOOR = 1e-5


class YawEstimator:
    """Five attitude references with evenly spaced yaw, each with a 3-state velocity-yaw EKF.

    Their weights follow the likelihood of the velocity innovations; yaw and variance are those of
    the weighted sum.
    """

    def __init__(self) -> None:
        """Wait for a quiet moment to find the tilt."""
        self.rot = np.tile(np.eye(3), (MODELS, 1, 1))
        self.bias = np.zeros((MODELS, 3))
        self.state = np.zeros((MODELS, 3))
        self.cov = np.zeros((MODELS, 3, 3))
        self.weights = np.full(MODELS, 1.0 / MODELS)
        self.running = False
        self.yaw = 0.0
        self.variance = (0.5 * math.pi) ** 2
        self._accel = np.zeros(3)
        self._tilt_aligned = False
        self._velocity: Array | None = None
        self._accuracy = 0.0

    def set_velocity(self, velocity: Array, accuracy: float) -> None:
        """Offer a NE velocity (2,) and its 1-sigma accuracy, m/s, to the next step."""
        self._velocity = velocity[0:2].copy()
        self._accuracy = accuracy

    def step(self, imu: Array, airborne: bool, airspeed: float, gyro_bias: Array) -> None:
        """Advance by one filter period; imu (8,) raw increments, airspeed m/s (0 = unknown)."""
        dt = imu[7]
        accel = imu[3:6] / max(dt, 1e-3)
        share = min(10.0 * dt * TILT_GAIN, 1.0)
        self._accel = self._accel * (1.0 - share) + accel * share
        velocity, self._velocity = self._velocity, None
        if not self._tilt_aligned:
            self._velocity = velocity
            self._align_tilt(imu[3:6], float(np.linalg.norm(accel)))
            return
        predict_attitudes(self.rot, self.bias, imu, self._accel, self._gain(airspeed), airspeed)
        if self.running:
            predict_models(self.rot, self.state, self.cov, imu)
        if airborne and velocity is not None:
            self._use(velocity, gyro_bias)
        elif not airborne:
            self.running = False
        if self.running:
            self._combine()

    def _align_tilt(self, delta_velocity: Array, norm: float) -> None:
        if not 0.9 * GRAVITY < norm < 1.1 * GRAVITY:
            return
        down = -delta_velocity / np.linalg.norm(delta_velocity)
        north = np.array((1.0, 0.0, 0.0)) - down * down[0]
        north /= np.linalg.norm(north)
        self.rot[:] = np.vstack((north, np.cross(down, north), down))
        self._tilt_aligned = True

    def _gain(self, airspeed: float) -> float:
        """Trust the accelerometer less the farther it is from 1 g."""
        norm = float(np.linalg.norm(self._accel))
        attenuation = 1.0 if airspeed > 0.0 and norm > GRAVITY else 2.0
        excess = min(attenuation * abs(norm - GRAVITY) / GRAVITY, 1.0)
        return TILT_GAIN * (1.0 - excess) ** 2

    def _use(self, velocity: Array, gyro_bias: Array) -> None:
        if not self.running:
            self._start(velocity, gyro_bias)
            return
        density = np.zeros(MODELS)
        if not correct_models(self.rot, self.state, self.cov, velocity, self._accuracy, density):
            return
        self.weights *= density
        floored = self.weights < WEIGHT_FLOOR
        if floored.all():
            self._reset_models(velocity)
            self.running = False
            return
        self.weights[floored] = WEIGHT_FLOOR
        self.weights /= self.weights.sum()

    def _start(self, velocity: Array, gyro_bias: Array) -> None:
        self._reset_models(velocity)
        for m in range(MODELS):
            self.rot[m] = with_yaw(self.rot[m], wrap_pi(float(self.state[m, 2])))
        self.bias[:] = gyro_bias
        self.running = True

    def _reset_models(self, velocity: Array) -> None:
        spacing = 2.0 * math.pi / MODELS
        self.weights[:] = 1.0 / MODELS
        self.state[:, 0:2] = velocity
        self.state[:, 2] = -math.pi + spacing * (np.arange(MODELS) + 0.5)
        self.cov[:] = 0.0
        self.cov[:, 0, 0] = self.cov[:, 1, 1] = self._accuracy ** 2
        self.cov[:, 2, 2] = (0.5 * spacing) ** 2

    def _combine(self) -> None:
        yaws = self.state[:, 2]
        east = float(self.weights @ np.sin(yaws))
        north = float(self.weights @ np.cos(yaws))
        self.yaw = math.atan2(east, north)
        spread = (yaws - self.yaw + math.pi) % (2.0 * math.pi) - math.pi
        self.variance = float(self.weights @ (self.cov[:, 2, 2] + spread * spread))
