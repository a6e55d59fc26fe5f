"""Position of a motion-capture system."""

from __future__ import annotations

from typing import ClassVar

from ekf_fusion_ros.lpe.sensors.external_position import ExternalPosition
from ekf_fusion_ros.lpe.state import SECOND


class Mocap(ExternalPosition):
    """Of the present, and always right: a contradiction is told, not dropped."""

    name: ClassVar[str] = 'mocap'
    size: ClassVar[int] = 3
    required: ClassVar[int] = 20
    timeout_us: ClassVar[int] = SECOND // 5
    drops_faulty: ClassVar[bool] = False

    def floors(self) -> tuple[float, float]:
        noise = self._f.params.vision.noise_mocap
        return noise, noise
