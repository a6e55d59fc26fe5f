"""Inertial measurement unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.mathlib.rotation import quat_inverse
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.mathlib.rotation import rotation_vector_from_quat
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.simulation import noise
from ekf_fusion_ros.simulation.sensor import ZERO
from ekf_fusion_ros.simulation.sensor import Sensor
from ekf_fusion_ros.simulation.sensor import Vector
from ekf_fusion_ros.simulation.trajectory import Motion
from ekf_fusion_ros.simulation.trajectory import Trajectory

Array = NDArray[np.float64]

# Gauss-Legendre nodes on [0, 1] and weights: the force integral is exact to order 6.
_NODES = (0.5 - 0.15 ** 0.5, 0.5, 0.5 + 0.15 ** 0.5)
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)


@dataclass(frozen=True, kw_only=True)
class Imu(Sensor):
    """Exact increments of angle and velocity plus bias, its random walk, and white noise.

    Noise densities in rad/s/sqrt(Hz) and m/s^2/sqrt(Hz); biases (3,) rad/s and m/s^2 FRD; bias
    walks in rad/s/sqrt(s) and m/s^2/sqrt(s). The defaults are those of a consumer MEMS part.
    """

    rate: float = 250.0
    gyro_noise: float = 1.5e-4
    accel_noise: float = 2.0e-3
    gyro_bias: Vector = ZERO
    accel_bias: Vector = ZERO
    gyro_walk: float = 1.0e-5
    accel_walk: float = 1.0e-4

    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[ImuSample]:
        edges = self.instants_us(trajectory)
        dt = np.diff(edges) * 1e-6
        angle = _angle_increments(trajectory, edges)
        velocity = _velocity_increments(trajectory, edges, np.array(self.lever_arm))
        angle += self._errors(rng, self.gyro_bias, self.gyro_noise, self.gyro_walk, dt)
        velocity += self._errors(rng, self.accel_bias, self.accel_noise, self.accel_walk, dt)
        kept = np.flatnonzero(self.present(edges[1:]))
        stamps = self.stamps(edges[1:], start_us)
        return [
            ImuSample(stamps[k], angle[k], velocity[k], float(dt[k]), float(dt[k])) for k in kept
        ]

    @staticmethod
    def _errors(
        rng: np.random.Generator, bias: Vector, density: float, walk: float, dt: Array,
    ) -> Array:
        """Return the integral of the errors over each interval (N, 3)."""
        column = dt[:, np.newaxis]
        drift = np.array(bias) + noise.random_walk(rng, walk, dt, 3)
        return drift * column + noise.white(rng, density, (len(dt), 3)) * np.sqrt(column)


def _angle_increments(trajectory: Trajectory, edges: NDArray[np.int64]) -> Array:
    """Return the rotation vector over each interval (N - 1, 3), coning included."""
    q = trajectory.motion(edges * 1e-6).quaternion
    return np.array([
        rotation_vector_from_quat(_short(quat_multiply(quat_inverse(before), after)))
        for before, after in pairwise(q)
    ])


def _short(q: Array) -> Array:
    return -q if q[0] < 0.0 else q


def _velocity_increments(
    trajectory: Trajectory, edges: NDArray[np.int64], lever_arm: Array,
) -> Array:
    """Return the specific force integrated in the turning body over each interval (N - 1, 3)."""
    begin = edges[:-1] * 1e-6
    dt = np.diff(edges) * 1e-6
    total = np.zeros((len(dt), 3))
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        motion: Motion = trajectory.motion(begin + node * dt).at_point(lever_arm)
        total += weight * motion.specific_force * dt[:, np.newaxis]
    return total
