"""Laser or infrared range finder."""

from __future__ import annotations

from typing import ClassVar

from ekf_fusion_ros.lpe.sensors.range_finder import Height
from ekf_fusion_ros.lpe.sensors.range_finder import RangeFinder
from ekf_fusion_ros.lpe.state import SECOND


class Lidar(RangeFinder):
    """Precise: the samples that initialise it must come one after the other."""

    name: ClassVar[str] = 'lidar'
    timeout_us: ClassVar[int] = SECOND

    _last: Height | None = None

    def noise(self) -> float:
        return self._f.params.lidar.noise

    def offset(self) -> float:
        return self._f.params.lidar.offset

    def note_bad(self) -> None:
        if self.timed_out:
            self.forget()

    def gather(self, measured: Height) -> bool:
        self._last = measured
        return True

    def begin(self) -> None:
        assert self._last is not None
        self.place_terrain(self._last)
        super().begin()
