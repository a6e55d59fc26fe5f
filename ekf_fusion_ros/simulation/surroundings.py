"""The air that a vehicle flies in and the ground below it, analytic in time and place."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# Each step shrinks the error by the product of slope and tangent of tilt.
_ITERATIONS = 40
_STEEPEST = 0.05


@dataclass(frozen=True, kw_only=True)
class Wind:
    """Where the air goes: a mean (north, east, down) in m/s and a gust along it.

    The gust is a sine of amplitude `gust` m/s and `gust_period` s.
    """

    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gust: float = 0.0
    gust_period: float = 20.0

    def velocity(self, instants: Array) -> Array:
        """Return the velocity of the air (N, 3) NED in m/s at instants (N,), s from the start."""
        mean = np.array(self.mean)
        direction = mean / max(float(np.linalg.norm(mean)), 1e-9)
        swing = self.gust * np.sin(math.tau * np.asarray(instants) / self.gust_period)
        return mean + swing[:, np.newaxis] * direction


@dataclass(frozen=True, kw_only=True)
class Terrain:
    """Ground: a plane through `height` m at the origin, and hills along the north axis.

    slope (north, east) m/m is positive uphill; hills are a sine of amplitude `hill` m and
    `wavelength` m.
    """

    height: float = 0.0
    slope: tuple[float, float] = (0.0, 0.0)
    hill: float = 0.0
    wavelength: float = 100.0

    def down(self, north: Array, east: Array) -> Array:
        """Return the down coordinate of the ground in m."""
        rise = self.slope[0] * north + self.slope[1] * east
        return -(self.height + rise + self.hill * np.sin(math.tau * north / self.wavelength))

    def distance(self, position: Array, direction: Array) -> Array:
        """Return the way (N,) in m to the ground from places (N, 3) along unit vectors (N, 3) NED.

        inf where the direction does not point down; found by fixed-point iteration.
        """
        fall = np.maximum(direction[:, 2], _STEEPEST)
        way = np.zeros(len(position))
        for _ in range(_ITERATIONS):
            hit = position + way[:, np.newaxis] * direction
            way = (self.down(hit[:, 0], hit[:, 1]) - position[:, 2]) / fall
        return np.where(direction[:, 2] > _STEEPEST, way, math.inf)
