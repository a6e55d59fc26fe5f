"""Satellite navigation receiver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.geo.projection import LocalTangent
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.simulation import noise
from ekf_fusion_ros.simulation.sensor import Sensor
from ekf_fusion_ros.simulation.sensor import intervals
from ekf_fusion_ros.simulation.trajectory import Trajectory


@dataclass(frozen=True, kw_only=True)
class Gnss(Sensor):
    """Position with white and slowly varying errors, velocity with white errors.

    Errors per horizontal axis: white 1-sigma `pos_noise` m plus a Gauss-Markov process of
    1-sigma `pos_correlated` m and `correlation_time` s; the vertical ones are `vertical_factor`
    times larger. The receiver claims the root sum square of both, as an honest one does.
    """

    origin: GeoPoint
    rate: float = 5.0
    pos_noise: float = 1.2
    pos_correlated: float = 0.5
    correlation_time: float = 60.0
    vertical_factor: float = 1.5
    vel_noise: float = 0.1
    has_velocity: bool = True
    nsats: int = 12
    pdop: float = 1.2

    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[GnssSample]:
        instants = self.instants_us(trajectory)
        antenna = trajectory.motion(instants * 1e-6).at_point(np.array(self.lever_arm))
        n = len(instants)
        axes = np.array([1.0, 1.0, self.vertical_factor])
        slow = noise.gauss_markov(
            rng, self.pos_correlated, self.correlation_time, intervals(instants), 3)
        position = antenna.position + axes * (noise.white(rng, self.pos_noise, (n, 3)) + slow)
        velocity = antenna.velocity + axes * noise.white(rng, self.vel_noise, (n, 3))
        tangent = LocalTangent(self.origin.lat, self.origin.lon, self.origin.alt)
        stamps = self.stamps(instants, start_us)
        samples = []
        for k in np.flatnonzero(self.present(instants)):
            north, east, down = position[k]
            lat, lon, alt = tangent.to_geodetic(east, north, -down)
            samples.append(self._sample(stamps[k], lat, lon, alt, velocity[k]))
        return samples

    def _sample(
        self, time_us: int, lat: float, lon: float, alt: float, velocity: noise.Array,
    ) -> GnssSample:
        sigma = max(math.hypot(self.pos_noise, self.pos_correlated), 0.01)
        return GnssSample(
            time_us, lat, lon, alt, eph=sigma, epv=self.vertical_factor * sigma,
            velocity=velocity if self.has_velocity else NAN3, sacc=max(self.vel_noise, 0.01),
            nsats=self.nsats, pdop=self.pdop)
