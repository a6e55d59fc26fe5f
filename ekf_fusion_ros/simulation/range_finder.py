"""Range finder that looks down."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.samples import RangeSample
from ekf_fusion_ros.simulation import noise
from ekf_fusion_ros.simulation.sensor import Sensor
from ekf_fusion_ros.simulation.sensor import Window
from ekf_fusion_ros.simulation.sensor import intervals
from ekf_fusion_ros.simulation.trajectory import Motion
from ekf_fusion_ros.simulation.trajectory import Trajectory

Array = NDArray[np.float64]
NO_DISTANCE = 0
UNKNOWN_QUALITY = -1


@dataclass(frozen=True, kw_only=True)
class RangeFinder(Sensor):
    """Slant distance to the ground along the body's z axis, turned forward by `pitch` rad.

    Errors: `bias` m, a random walk of `drift` m/sqrt(s), white noise of `distance_noise` m plus
    `relative_noise` of the distance. A share `dropout` of the readings, and all beyond the limits
    or a tilt of `max_tilt` rad, come without distance (quality 0, at the limit). In `stuck`
    windows the last reading is repeated.
    """

    rate: float = 30.0
    pitch: float = 0.0
    bias: float = 0.0
    drift: float = 0.0
    distance_noise: float = 0.03
    relative_noise: float = 0.0
    dropout: float = 0.0
    min_distance: float = 0.2
    max_distance: float = 20.0
    max_tilt: float = math.radians(60.0)
    stuck: tuple[Window, ...] = ()

    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[RangeSample]:
        instants = self.instants_us(trajectory)
        place = trajectory.motion(instants * 1e-6).at_point(np.array(self.lever_arm))
        true, tilt_cosine = boresight(trajectory, place, self.pitch)
        n = len(instants)
        lost = (rng.random(n) < self.dropout) | (tilt_cosine < math.cos(self.max_tilt))
        true = np.where(lost, math.inf, true)
        sigma = self.distance_noise + self.relative_noise * np.minimum(true, self.max_distance)
        distance = true + self.bias + sigma * noise.white(rng, 1.0, (n,))
        distance += noise.random_walk(rng, self.drift, intervals(instants), 1)[:, 0]
        distance = self._repeated(distance, instants)
        stamps = self.stamps(instants, start_us)
        return [self._sample(stamps[k], float(distance[k]))
                for k in np.flatnonzero(self.present(instants))]

    def _repeated(self, distance: Array, instants: NDArray[np.int64]) -> Array:
        for begin, end in self.stuck:
            inside = (instants * 1e-6 >= begin) & (instants * 1e-6 < end)
            before = int(np.argmax(inside)) - 1
            distance = np.where(inside, distance[max(before, 0)], distance)
        return distance

    def _sample(self, time_us: int, distance: float) -> RangeSample:
        seen = self.min_distance <= distance <= self.max_distance
        clipped = min(max(distance, self.min_distance), self.max_distance)
        quality = UNKNOWN_QUALITY if seen else NO_DISTANCE
        return RangeSample(time_us, clipped, quality, self.min_distance, self.max_distance)


def boresight(trajectory: Trajectory, place: Motion, pitch: float = 0.0) -> tuple[Array, Array]:
    """Return distance (N,) to the ground along a sensor's axis and the cosine of its tilt."""
    axis = place.to_earth(np.array([math.sin(pitch), 0.0, math.cos(pitch)]))
    return trajectory.terrain.distance(place.position, axis), axis[:, 2]
