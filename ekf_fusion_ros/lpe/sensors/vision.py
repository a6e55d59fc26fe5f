"""Position of visual or other odometry."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.lpe.sensors.external_position import ExternalPosition
from ekf_fusion_ros.lpe.sensors.sensor import TOO_LATE
from ekf_fusion_ros.lpe.state import SECOND


class Vision(ExternalPosition):
    """Compared with the state at its time; its velocity is not used, as in PX4."""

    name: ClassVar[str] = 'vision'
    size: ClassVar[int] = 3
    required: ClassVar[int] = 1
    timeout_us: ClassVar[int] = SECOND // 2

    def floors(self) -> tuple[float, float]:
        params = self._f.params.vision
        return params.noise_xy, params.noise_z

    def state_at(self, time_us: int) -> NDArray[np.float64] | None:
        f = self._f
        taken_us = time_us - round(SECOND * f.params.vision.delay)
        then = f.history.at(taken_us, f.now_us, f.x)
        if then is None:
            self.passed_over[TOO_LATE] += 1
        return then
