"""Optical-flow camera that looks down."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import FlowSample
from ekf_fusion_ros.simulation import noise
from ekf_fusion_ros.simulation.range_finder import boresight
from ekf_fusion_ros.simulation.sensor import ZERO
from ekf_fusion_ros.simulation.sensor import Sensor
from ekf_fusion_ros.simulation.sensor import Vector
from ekf_fusion_ros.simulation.trajectory import Trajectory

Array = NDArray[np.float64]
BEST_QUALITY = 255
# Gauss-Legendre nodes on [0, 1] and weights.
_NODES = (0.5 - 0.15 ** 0.5, 0.5, 0.5 + 0.15 ** 0.5)
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)


@dataclass(frozen=True, kw_only=True)
class OpticalFlow(Sensor):
    """Angle of the scene over each exposure, which ends at the time of measurement.

    Rates are (v_right, -v_forward) / distance less the body's rotation about x and y, plus `bias`
    (2,) rad/s and white noise of `flow_noise` rad/s. The gyro, where there is one, gives minus the
    rotation plus `gyro_bias` rad/s and white noise of `gyro_noise` rad/s. The quality is
    `quality`, but 0 for distances outside [min_distance, max_distance] and for scenes faster than
    `max_rate` rad/s.
    """

    rate: float = 20.0
    bias: tuple[float, float] = (0.0, 0.0)
    flow_noise: float = 0.05
    has_gyro: bool = True
    gyro_bias: Vector = ZERO
    gyro_noise: float = 0.002
    quality: int = 200
    min_distance: float = 0.3
    max_distance: float = 40.0
    max_rate: float = 5.0

    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[FlowSample]:
        edges = self.instants_us(trajectory)
        dt = np.diff(edges) * 1e-6
        column = dt[:, np.newaxis]
        scene, turn, near = self._exposures(trajectory, edges)
        fast = np.linalg.norm(scene, axis=1) > self.max_rate * dt
        quality = np.where(near & ~fast, self.quality, 0)
        scene += column * (np.array(self.bias) + noise.white(rng, self.flow_noise, scene.shape))
        gyro = column * (np.array(self.gyro_bias) + noise.white(rng, self.gyro_noise, turn.shape))
        gyro -= turn
        stamps = self.stamps(edges[1:], start_us)
        return [
            FlowSample(stamps[k], scene[k], gyro[k] if self.has_gyro else NAN3, int(quality[k]),
                       float(dt[k]))
            for k in np.flatnonzero(self.present(edges[1:]))
        ]

    def _exposures(
        self, trajectory: Trajectory, edges: NDArray[np.int64],
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return angles of scene (N, 2) and body (N, 3), and where the ground is in sight."""
        begin, dt = edges[:-1] * 1e-6, np.diff(edges) * 1e-6
        scene, turn = np.zeros((len(dt), 2)), np.zeros((len(dt), 3))
        near = np.ones(len(dt), dtype=bool)
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            camera = trajectory.motion(begin + node * dt).at_point(np.array(self.lever_arm))
            distance, _ = boresight(trajectory, camera)
            near &= (distance >= self.min_distance) & (distance <= self.max_distance)
            velocity = camera.to_body(camera.velocity)
            across = np.stack([velocity[:, 1], -velocity[:, 0]], axis=1)
            share = (weight * dt)[:, np.newaxis]
            reach = np.maximum(distance, self.min_distance)[:, np.newaxis]
            scene += share * (across / reach - camera.rate[:, :2])
            turn += share * camera.rate
        return scene, turn, near
