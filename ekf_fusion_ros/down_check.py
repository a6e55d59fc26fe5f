"""Whether the inertial data feel gravity, and feel it where the odometry says that down is."""

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
LEAST, MOST = 5.0, 30.0
"""Mean specific force in m/s^2 that vehicles keep between, turns of aeroplanes included."""


class DownCheck:
    """Compares mean specific force and mean attitude of the first seconds of a track, once.

    Each sensor turned against the body by what its parameters say sees down where the other does.
    Without an attitude of the odometry a vehicle is taken to begin the right way up.
    """

    def __init__(self, *, imu: bool) -> None:
        """imu: one is in use, so that there is something to check."""
        self._felt = np.zeros(3)
        self._stated = np.zeros(3)
        self._elapsed = 0.0
        self.open = imu
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
        self.sentence = self._judgement()
        return bool(self.sentence)

    def _judgement(self) -> str:
        felt, stated = float(np.linalg.norm(self._felt)), float(np.linalg.norm(self._stated))
        mean = felt / self._elapsed
        if not LEAST < mean < MOST:
            return (f'the imu feels {mean:.1f} m/s^2 on average where gravity makes 9.8: its '
                    'linear_acceleration must be in m/s^2 with gravity left in it')
        if stated == 0.0:
            upside_down = -self._felt[2] < -math.cos(APART) * felt
            return ('the imu says that the vehicle lies upside down: turn it by '
                    'messages.imu.mount_rpy, or end its frame_id in _frd if its z axis points '
                    'down') if upside_down else ''
        cosine = float(self._felt @ self._stated / (felt * stated))
        apart = math.acos(min(max(cosine, -1.0), 1.0))
        if apart <= APART:
            return ''
        return (f'imu and odometry see down {math.degrees(apart):.0f} deg apart: a sensor sits '
                'turned in the body, set messages.imu.mount_rpy or messages.odometry.mount_rpy')
