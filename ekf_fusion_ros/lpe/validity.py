"""Which parts of the estimate are good enough to move and to be flown by."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.lpe.state import PD
from ekf_fusion_ros.lpe.state import TERRAIN
from ekf_fusion_ros.lpe.state import VE
from ekf_fusion_ros.lpe.state import VN
from ekf_fusion_ros.params.lpe import ProcessParams

Array = NDArray[np.float64]


class Validity:
    """Horizontal, height and terrain validity, by standard deviation and time-out.

    Deviations make valid; horizontal and height stay so while GNSS or the barometer, their usual
    sources, deliver, whatever the deviation.
    """

    def __init__(self) -> None:
        """Nothing is valid."""
        self.horizontal = False
        self.height = False
        self.terrain = False

    def step(
        self, P: Array, params: ProcessParams, *, aided: bool, gnss: bool, baro: bool,
    ) -> None:
        """Judge by the covariance (10, 10) and by which sensors deliver.

        aided: at least one sensor of horizontal position or velocity, gnss and baro: that one.
        """
        precise = bool(max(P[VN, VN], P[VE, VE]) < params.velocity_sigma_max ** 2)
        self.horizontal = (precise or gnss) if self.horizontal else (precise and aided)
        known = bool(P[PD, PD] < params.height_sigma_max ** 2)
        self.height = known or (self.height and baro)
        self.terrain = bool(P[TERRAIN, TERRAIN] < params.height_sigma_max ** 2)
