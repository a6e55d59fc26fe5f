"""Airspeed sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ekf_fusion_ros.geo.atmosphere import true_from_equivalent
from ekf_fusion_ros.samples import AirspeedSample
from ekf_fusion_ros.simulation import noise
from ekf_fusion_ros.simulation.sensor import Sensor
from ekf_fusion_ros.simulation.sensor import intervals
from ekf_fusion_ros.simulation.trajectory import Trajectory


@dataclass(frozen=True, kw_only=True)
class Airspeed(Sensor):
    """Equivalent airspeed, made true by the density at `reference` m plus the height.

    Errors in equivalent airspeed: `scale` relative, `bias` m/s, a random walk of `drift`
    m/s/sqrt(s), white noise of `speed_noise` m/s. Nothing below zero is measured.
    """

    rate: float = 20.0
    reference: float = 0.0
    scale: float = 0.0
    bias: float = 0.0
    drift: float = 0.0
    speed_noise: float = 0.5

    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[AirspeedSample]:
        instants = self.instants_us(trajectory)
        pitot = trajectory.motion(instants * 1e-6).at_point(np.array(self.lever_arm))
        through_air = pitot.velocity - trajectory.wind.velocity(pitot.time)
        factor = np.array([true_from_equivalent(self.reference - down)
                           for down in pitot.position[:, 2]])
        speed = (1.0 + self.scale) * np.linalg.norm(through_air, axis=1) / factor + self.bias
        speed += noise.random_walk(rng, self.drift, intervals(instants), 1)[:, 0]
        speed += noise.white(rng, self.speed_noise, speed.shape)
        true = np.maximum(speed, 0.0) * factor
        stamps = self.stamps(instants, start_us)
        return [AirspeedSample(stamps[k], float(true[k]), float(factor[k]))
                for k in np.flatnonzero(self.present(instants))]
