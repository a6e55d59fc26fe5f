"""Ultrasonic range finder."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ekf_fusion_ros.lpe.correction import Measurement
from ekf_fusion_ros.lpe.filter import Filter
from ekf_fusion_ros.lpe.sensors.range_finder import Height
from ekf_fusion_ros.lpe.sensors.range_finder import RangeFinder
from ekf_fusion_ros.lpe.sensors.sensor import Sensor
from ekf_fusion_ros.lpe.state import SECOND

SIGMA_MAX = 0.3
"""m; samples of the initialisation that scatter more are echoes of something else."""


class Sonar(RangeFinder):
    """Loses echoes and sees phantoms: its first samples must agree, within 5 s.

    Where a lidar has just corrected, it has nothing to add.
    """

    name: ClassVar[str] = 'sonar'
    timeout_us: ClassVar[int] = 5 * SECOND

    def __init__(self, f: Filter, lidar: Sensor) -> None:
        super().__init__(f)
        self._lidar = lidar
        self._gathered: list[Height] = []
        self._begun_us = 0

    def noise(self) -> float:
        return self._f.params.sonar.noise

    def offset(self) -> float:
        return self._f.params.sonar.offset

    def gather(self, measured: Height) -> bool:
        if not self._gathered:
            self._begun_us = self._f.now_us
        self._gathered.append(measured)
        scatter = float(np.std([sample.height for sample in self._gathered]))
        return scatter <= SIGMA_MAX and self._f.now_us - self._begun_us <= self.timeout_us

    def begin(self) -> None:
        self.place_terrain(self._gathered[-1])
        super().begin()

    def forget(self) -> None:
        super().forget()
        self._gathered = []

    def model(self, measured: Height) -> Measurement | None:
        lidar = self._lidar
        if lidar.updated and not lidar.faulty and not lidar.timed_out:
            self.passed_over['lidar_is_better'] += 1
            return None
        return super().model(measured)
