"""Satellite navigation receiver with two antennas, which knows the heading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.simulation import noise
from ekf_fusion_ros.simulation.gnss import Gnss
from ekf_fusion_ros.simulation.sensor import Window
from ekf_fusion_ros.simulation.sensor import intervals
from ekf_fusion_ros.simulation.trajectory import Trajectory


@dataclass(frozen=True, kw_only=True)
class DualAntennaGnss(Gnss):
    """A receiver that also gives the heading of the vehicle.

    It measures the horizontal direction of the axis through its antennas, which points
    `antenna_offset` rad from body forward (clockwise), and takes the offset off. Errors:
    `heading_bias` rad, a random walk of `heading_drift` rad/sqrt(s), white noise of
    `heading_noise` rad. There is no heading inside `heading_outages`. The position and velocity
    are those of a Gnss of the same random stream.
    """

    antenna_offset: float = 0.0
    heading_bias: float = 0.0
    heading_drift: float = 0.0
    heading_noise: float = 0.02
    heading_outages: tuple[Window, ...] = ()

    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[GnssSample]:
        samples = super().measure(trajectory, start_us, rng)
        instants = self.instants_us(trajectory)
        heading = self._heading(trajectory, instants, rng)[self.present(instants)]
        accuracy = max(self.heading_noise, 0.001)
        return [
            sample._replace(yaw=wrap_pi(float(yaw)), yaw_offset=self.antenna_offset,
                    yaw_accuracy=accuracy) if math.isfinite(yaw) else sample
            for sample, yaw in zip(samples, heading, strict=True)
        ]

    def _heading(
        self, trajectory: Trajectory, instants: NDArray[np.int64], rng: np.random.Generator,
    ) -> noise.Array:
        offset = self.antenna_offset
        motion = trajectory.motion(instants * 1e-6)
        axis = motion.to_earth(np.array([math.cos(offset), math.sin(offset), 0.0]))
        heading = np.arctan2(axis[:, 1], axis[:, 0]) - offset + self.heading_bias
        heading += noise.random_walk(rng, self.heading_drift, intervals(instants), 1)[:, 0]
        heading += noise.white(rng, self.heading_noise, heading.shape)
        known = replace(self, outages=self.heading_outages).present(instants)
        return np.where(known, heading, math.nan)
