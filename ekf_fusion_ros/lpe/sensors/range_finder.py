"""What lidar and sonar share: a distance to the ground along the body's down axis."""

from __future__ import annotations

from typing import ClassVar
from typing import NamedTuple

import numpy as np

from ekf_fusion_ros.lpe.correction import Measurement
from ekf_fusion_ros.lpe.sensors.sensor import Sensor
from ekf_fusion_ros.lpe.state import PD
from ekf_fusion_ros.lpe.state import SIZE
from ekf_fusion_ros.lpe.state import TERRAIN
from ekf_fusion_ros.samples import RangeSample

C = np.zeros((1, SIZE))
C[0, PD], C[0, TERRAIN] = -1.0, 1.0
MARGIN = 0.01
"""m inside the limits of the sensor within which a distance counts."""

LEAST_VARIANCE = 1e-3
"""m^2 below which a sensor is not believed to know its noise."""


class Height(NamedTuple):
    """Height above ground in m, its variance in m^2."""

    height: float
    variance: float


class RangeFinder(Sensor):
    """Height above ground: the distance times the cosine of the tilt."""

    required: ClassVar[int] = 10

    def noise(self) -> float:
        """Return the standard deviation of a sensor that tells none, m."""
        raise NotImplementedError

    def offset(self) -> float:
        """Return the place of the sensor below the body origin, m."""
        raise NotImplementedError

    def measure(self, sample: RangeSample) -> Height | None:
        low = max(sample.min_distance, 0.0) + MARGIN
        within = low <= sample.distance <= sample.max_distance - MARGIN
        cosine = float(self._f.attitude.rot[2, 2])
        if not within or sample.quality == 0 or cosine <= 0.0:
            self.passed_over['no_distance'] += 1
            self.note_bad()
            return None
        told = sample.variance >= LEAST_VARIANCE
        return Height((sample.distance + self.offset()) * cosine,
                      sample.variance if told else self.noise() ** 2)

    def note_bad(self) -> None:
        """Hear of a sample without distance."""

    def place_terrain(self, height: Height) -> None:
        """Let the terrain begin where this says, unless it is known.

        PX4 begins it at the height of the start; a range finder that is switched on in the air
        would contradict that for ever.
        """
        if not self._f.valid.terrain:
            self._f.place_terrain(height.height, height.variance)

    def model(self, measured: Height) -> Measurement | None:
        return Measurement(np.array((measured.height,)), C, np.array((measured.variance,)))
