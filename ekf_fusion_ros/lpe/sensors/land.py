"""What standing on the ground tells: no horizontal velocity, no height above ground."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ekf_fusion_ros.lpe.correction import Measurement
from ekf_fusion_ros.lpe.filter import Filter
from ekf_fusion_ros.lpe.sensors.gnss import Gnss
from ekf_fusion_ros.lpe.sensors.sensor import Sensor
from ekf_fusion_ros.lpe.state import PD
from ekf_fusion_ros.lpe.state import SECOND
from ekf_fusion_ros.lpe.state import SIZE
from ekf_fusion_ros.lpe.state import TERRAIN
from ekf_fusion_ros.lpe.state import VE
from ekf_fusion_ros.lpe.state import VN
from ekf_fusion_ros.samples import LandedSample

C = np.zeros((3, SIZE))
C[0, VN] = C[1, VE] = 1.0
C[2, PD], C[2, TERRAIN] = -1.0, 1.0
ZERO = np.zeros(3)
PERIOD_US = SECOND // 10


class Land(Sensor):
    """Measures at 10 Hz while the vehicle is said to be landed, whatever the rate of that.

    Not while fixes travel: a detector that is stuck would hold the velocity at zero, and with it
    the innovation by which it could be found out.
    """

    name: ClassVar[str] = 'land'
    size: ClassVar[int] = 3
    required: ClassVar[int] = 1
    timeout_us: ClassVar[int] = SECOND
    tolerance: ClassVar[float] = 100.0

    def __init__(self, f: Filter, gnss: Gnss) -> None:
        super().__init__(f)
        self._gnss = gnss
        self._contradicted = False

    @property
    def believed(self) -> bool:
        """True while the vehicle is said to be landed and no fix contradicts."""
        return bool(self._f.landed) and not self._gnss.moves

    def enabled(self) -> bool:
        return self._f.params.land.enabled

    def push(self, sample: LandedSample) -> None:
        self._f.landed = sample.landed
        if not self.enabled():
            self.passed_over['not_enabled'] += 1

    def step(self) -> None:
        self._tell_contradiction()
        due = self._f.now_us - self._last_us >= PERIOD_US
        if self.enabled() and self.believed and due:
            self._waiting.append(True)
        super().step()

    def _tell_contradiction(self) -> None:
        contradicted = bool(self._f.landed) and self._gnss.moves
        if contradicted and not self._contradicted:
            self._f.tell('said to be landed while the fixes travel: not believed')
        self._contradicted = contradicted

    def measure(self, sample: bool) -> bool:
        return sample

    def model(self, measured: bool) -> Measurement:
        params = self._f.params.land
        variances = np.array((params.noise_vxy, params.noise_vxy, params.noise_z)) ** 2
        return Measurement(ZERO, C, variances)
