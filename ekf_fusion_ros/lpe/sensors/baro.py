"""Barometric height, relative to where the barometer began."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ekf_fusion_ros.lpe.correction import Measurement
from ekf_fusion_ros.lpe.sensors.sensor import Sensor
from ekf_fusion_ros.lpe.state import PD
from ekf_fusion_ros.lpe.state import SECOND
from ekf_fusion_ros.lpe.state import SIZE
from ekf_fusion_ros.samples import BaroSample

C = np.zeros((1, SIZE))
C[0, PD] = -1.0


class Baro(Sensor):
    """Height above the pressure altitude that fits the height of the filter at the beginning.

    A barometer that comes back refers to the height of that moment, where PX4 would step to zero.
    PX4 times out after 0.1 s, which ROS topics of 10 Hz would not survive.
    """

    name: ClassVar[str] = 'baro'
    required: ClassVar[int] = 100
    timeout_us: ClassVar[int] = SECOND // 2
    drops_faulty: ClassVar[bool] = False

    altitude_of_origin = 0.0
    _sum = 0.0

    def enabled(self) -> bool:
        return self._f.params.baro.enabled

    def measure(self, sample: BaroSample) -> float:
        return sample.altitude

    def gather(self, measured: float) -> bool:
        self._sum += measured + float(self._f.x[PD])
        return True

    def begin(self) -> None:
        self.altitude_of_origin = self._sum / self._good
        super().begin()

    def forget(self) -> None:
        super().forget()
        self._sum = 0.0

    def move(self, down: float) -> None:
        """Follow a change of the down coordinate of the vehicle in m."""
        self.altitude_of_origin += down

    def model(self, measured: float) -> Measurement:
        noise = self._f.params.baro.noise
        return Measurement(np.array((measured - self.altitude_of_origin,)), C,
                           np.array((noise ** 2,)))
