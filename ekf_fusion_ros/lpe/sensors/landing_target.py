"""Velocity against a landing target at rest."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ekf_fusion_ros.lpe.correction import Measurement
from ekf_fusion_ros.lpe.sensors.sensor import Sensor
from ekf_fusion_ros.lpe.state import SECOND
from ekf_fusion_ros.lpe.state import SIZE
from ekf_fusion_ros.lpe.state import VE
from ekf_fusion_ros.lpe.state import VN
from ekf_fusion_ros.samples import AuxVelocitySample

C = np.zeros((2, SIZE))
C[0, VN] = C[1, VE] = 1.0


class LandingTarget(Sensor):
    """Horizontal velocity of the vehicle over the target; each axis has its own least variance.

    PX4 measures the target against the vehicle, with the opposite sign.
    """

    name: ClassVar[str] = 'landing_target'
    size: ClassVar[int] = 2
    required: ClassVar[int] = 0
    timeout_us: ClassVar[int] = 2 * SECOND

    def enabled(self) -> bool:
        return self._f.params.landing_target.enabled

    def measure(self, sample: AuxVelocitySample) -> AuxVelocitySample:
        return sample

    def model(self, measured: AuxVelocitySample) -> Measurement:
        least = self._f.params.landing_target.min_variance
        return Measurement(
            measured.velocity[:2], C, np.maximum(measured.variance[:2], max(least, 1e-12)))
