"""Visual-inertial odometry: smooth, drifting, in a frame of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.mathlib.rotation import quat_from_rotation_vector
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.samples import VisionSample
from ekf_fusion_ros.simulation import noise
from ekf_fusion_ros.simulation.sensor import Sensor
from ekf_fusion_ros.simulation.sensor import intervals
from ekf_fusion_ros.simulation.trajectory import Motion
from ekf_fusion_ros.simulation.trajectory import Trajectory

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Vision(Sensor):
    """Odometry whose position is the sum of its own erroneous steps.

    heading rad: direction of the frame's x axis, clockwise from north; the frame starts at the
    first measurement. scale: constant relative error of distance. yaw_walk rad/sqrt(s) and
    yaw_rate_bias rad/s: drift of the heading. pos_noise m, vel_noise m/s, tilt_noise rad: white.
    `scale_sigma` is the scale error the source believes in when it states covariances.
    """

    rate: float = 30.0
    heading: float = 0.0
    scale: float = 0.0
    yaw_walk: float = 0.0
    yaw_rate_bias: float = 0.0
    pos_noise: float = 0.01
    vel_noise: float = 0.05
    tilt_noise: float = 0.003
    scale_sigma: float = 0.01
    reset_counter: int = 0

    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[VisionSample]:
        instants = self.instants_us(trajectory)
        camera = trajectory.motion(instants * 1e-6).at_point(np.array(self.lever_arm))
        drift = self._yaw_drift(instants, rng)
        position = self._walked(camera, drift - self.heading)
        position += noise.white(rng, self.pos_noise, position.shape)
        velocity = (1.0 + self.scale) * camera.to_body(camera.velocity)
        velocity += noise.white(rng, self.vel_noise, velocity.shape)
        quaternion = self._attitude(camera, drift - self.heading, rng)
        variance = self._position_variance(position, instants)
        stamps = self.stamps(instants, start_us)
        return [
            VisionSample(
                stamps[k], position[k], quaternion[k], velocity[k], variance[k],
                self._velocity_cov(velocity[k]), max(self.tilt_noise, 1e-3) ** 2,
                VelocityFrame.BODY_FRD, self.reset_counter)
            for k in np.flatnonzero(self.present(instants))
        ]

    def _yaw_drift(self, instants: NDArray[np.int64], rng: np.random.Generator) -> Array:
        walk = noise.random_walk(rng, self.yaw_walk, intervals(instants), 1)[:, 0]
        return walk + self.yaw_rate_bias * (instants - instants[0]) * 1e-6

    def _walked(self, camera: Motion, turn: Array) -> Array:
        """Sum up the true steps, each turned by the heading error at its middle and scaled."""
        steps = np.diff(camera.position, axis=0)
        angle = 0.5 * (turn[:-1] + turn[1:])
        c, s = np.cos(angle), np.sin(angle)
        north, east = c * steps[:, 0] - s * steps[:, 1], s * steps[:, 0] + c * steps[:, 1]
        seen = (1.0 + self.scale) * np.stack([north, east, steps[:, 2]], axis=1)
        return np.vstack([np.zeros(3), np.cumsum(seen, axis=0)])

    def _attitude(self, camera: Motion, turn: Array, rng: np.random.Generator) -> Array:
        tilt = noise.white(rng, self.tilt_noise, (len(turn), 3))
        attitude = camera.quaternion
        for k, angle in enumerate(turn):
            yaw = np.array([math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)])
            jitter = quat_from_rotation_vector(tilt[k])
            attitude[k] = quat_multiply(quat_multiply(yaw, attitude[k]), jitter)
        return attitude

    def _position_variance(self, position: Array, instants: NDArray[np.int64]) -> Array:
        """Return what an honest source claims (N, 3): scale and heading act on the distance."""
        elapsed = (instants - instants[0]) * 1e-6
        distance = np.linalg.norm(position - position[0], axis=1)
        yaw_var = self.yaw_walk ** 2 * elapsed + (self.yaw_rate_bias * elapsed) ** 2
        floor = max(self.pos_noise, 0.001) ** 2
        relative = self.scale_sigma ** 2 + np.stack([yaw_var, yaw_var, 0.0 * yaw_var], axis=1)
        return floor + relative * (distance ** 2)[:, np.newaxis]

    def _velocity_cov(self, velocity: Array) -> Array:
        scaled = self.scale_sigma * velocity
        return max(self.vel_noise, 0.01) ** 2 * np.eye(3) + np.outer(scaled, scaled)
