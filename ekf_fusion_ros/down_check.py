"""Whether IMU and odometry agree on where down is: a sensor that sits turned shows here."""

from __future__ import annotations

from collections.abc import Iterable
import math

import numpy as np

from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import VisionSample

SECONDS = 10.0
"""Over so long what a vehicle accelerates is little against gravity."""

APART = math.radians(30.0)


class DownCheck:
    """Compares mean specific force and mean attitude of the first seconds of a track, once.

    Each sensor turned against the body by what its parameters say sees down where the other does.
    """

    def __init__(self, *, both: bool) -> None:
        """both: IMU and odometry are in use, so that there is something to compare."""
        self._felt = np.zeros(3)
        self._stated = np.zeros(3)
        self._elapsed = 0.0
        self.open = both
        self.sentence = ''

    def note_odometry(self, sample: VisionSample) -> None:
        """Take an attitude, where the odometry has one."""
        if sample.has_attitude:
            self._stated -= matrix_from_quat(sample.quaternion)[2]

    def note_imu(self, increments: Iterable[ImuSample]) -> bool:
        """Take increments; True when they complete the check and it has something to say."""
        for imu in increments:
            self._felt += imu.delta_velocity
            self._elapsed += imu.delta_velocity_dt
        if self._elapsed < SECONDS:
            return False
        self.open = False
        felt, stated = np.linalg.norm(self._felt), np.linalg.norm(self._stated)
        if felt == 0.0 or stated == 0.0:
            return False
        cosine = float(self._felt @ self._stated / (felt * stated))
        apart = math.acos(min(max(cosine, -1.0), 1.0))
        if apart > APART:
            self.sentence = (
                f'imu and odometry see down {math.degrees(apart):.0f} deg apart: a sensor sits '
                'turned in the body, set messages.imu.mount_rpy or messages.odometry.mount_rpy')
        return apart > APART
