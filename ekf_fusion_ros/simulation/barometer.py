"""Barometer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.simulation import noise
from ekf_fusion_ros.simulation.sensor import Sensor
from ekf_fusion_ros.simulation.sensor import intervals
from ekf_fusion_ros.simulation.trajectory import Trajectory


@dataclass(frozen=True, kw_only=True)
class Barometer(Sensor):
    """Pressure altitude: `reference` m at the origin, constant bias, drift, white noise.

    drift m/sqrt(s) is the density of a random walk, as weather makes it.
    """

    rate: float = 50.0
    reference: float = 0.0
    bias: float = 0.0
    altitude_noise: float = 0.3
    drift: float = 0.02

    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[BaroSample]:
        instants = self.instants_us(trajectory)
        port = trajectory.motion(instants * 1e-6).at_point(np.array(self.lever_arm))
        altitude = self.reference - port.position[:, 2] + self.bias
        altitude += noise.random_walk(rng, self.drift, intervals(instants), 1)[:, 0]
        altitude += noise.white(rng, self.altitude_noise, altitude.shape)
        stamps = self.stamps(instants, start_us)
        return [
            BaroSample(stamps[k], float(altitude[k]))
            for k in np.flatnonzero(self.present(instants))
        ]
