"""What vision and motion capture share: a position in the local frame."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.lpe.correction import Measurement
from ekf_fusion_ros.lpe.filter import Filter
from ekf_fusion_ros.lpe.sensors.sensor import Sensor
from ekf_fusion_ros.lpe.state import POSITION
from ekf_fusion_ros.lpe.state import SIZE
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]

C = np.eye(3, SIZE)
ACCURACY_MAX = 100.0


class Place(NamedTuple):
    """Position (3,) m in the local frame, horizontal and vertical accuracy in m."""

    time_us: int
    position: Array
    eph: float
    epv: float


class ExternalPosition(Sensor):
    """Position plus the `offset` (3,) by which the local frame has moved or the source jumped."""

    def __init__(self, f: Filter) -> None:
        super().__init__(f)
        self.offset = np.zeros(3)
        self._resets: int | None = None

    def floors(self) -> tuple[float, float]:
        """Return the least horizontal and vertical noise, m."""
        raise NotImplementedError

    def state_at(self, time_us: int) -> Array | None:
        """Return the state (10,) that a measurement of a time tells of."""
        return self._f.x

    def enabled(self) -> bool:
        vision = self._f.params.vision
        return vision.enabled and vision.kind == self.name

    def measure(self, sample: VisionSample) -> Place | None:
        if not np.isfinite(sample.position).all():
            self.passed_over['no_position'] += 1
            return None
        # An accuracy that is not told leaves the least noise.
        north, east, down = np.where(
            np.isnan(sample.position_var), 0.0, sample.position_var).tolist()
        eph, epv = math.sqrt(max(north, east)), math.sqrt(down)
        if not max(eph, epv) <= ACCURACY_MAX:
            self.passed_over['not_accurate'] += 1
            return None
        if self._resets is not None and sample.reset_counter != self._resets:
            # The source says that its frame has moved: the vehicle has not.
            self.offset = self._f.x[POSITION] - sample.position
        self._resets = sample.reset_counter
        return Place(sample.time_us, sample.position + self.offset, eph, epv)

    def model(self, measured: Place) -> Measurement | None:
        then = self.state_at(measured.time_us)
        if then is None:
            return None
        xy, z = self.floors()
        xy, z = max(xy, measured.eph), max(z, measured.epv)
        return Measurement(measured.position, C, np.array((xy, xy, z)) ** 2, then)
