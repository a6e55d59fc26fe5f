"""Whether the gyro turns as far as the odometry or the magnetic field: deg/s are no rad/s."""

from __future__ import annotations

from collections.abc import Iterable
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.mathlib.rotation import cross
from ekf_fusion_ros.mathlib.rotation import quat_inverse
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.mathlib.rotation import rotation_vector_from_quat
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]

SEGMENT_US = 500_000
LONGEST_US = 2_000_000
"""Times between which turns are compared: few vehicles turn half round in the shorter one."""

SEGMENTS = 40
LEAST_TURN = 0.5
"""Turn in rad over all segments that no noise makes."""

IN_STEP = 0.7
"""Correlation from which two turns are taken to be of the same motion, not noise or rocking."""

TIMES = 10.0
"""How often the one turns as far as the other where units are wrong: degrees make 57."""


class TurnCheck:
    """Compares turns by gyro with those of the odometry's attitude, or else of the field.

    Of both what is constant is left out, a gyro bias with it. Where the two do not go together, as
    those of sensors that sit turned, nothing is said. The field shows only what is across it, and
    the gyro is compared in that.
    """

    def __init__(self, *, imu: bool) -> None:
        """imu: one is in use, so that there is something to check."""
        self.open = imu
        self.sentence = ''
        self._felt = np.zeros(3)
        self._begin_us = 0
        self._attitude: Array | None = None
        self._field: Array | None = None
        self._turns: list[tuple[Array, Array]] = []

    def note_imu(self, increments: Iterable[ImuSample]) -> None:
        """Take increments."""
        for imu in increments:
            self._felt += imu.delta_angle

    def note_odometry(self, sample: VisionSample) -> bool:
        """Take an attitude; True where it completes the check and something is wrong."""
        if not sample.has_attitude or not self._segment_ends(sample.time_us):
            return False
        begin, self._attitude, self._field = self._attitude, sample.quaternion, None
        felt = self._next_segment(sample.time_us)
        if begin is None or felt is None:
            return False
        turned = quat_multiply(quat_inverse(begin), sample.quaternion)
        turned *= math.copysign(1.0, turned[0])
        return self._add(rotation_vector_from_quat(turned), felt, 'the odometry')

    def note_field(self, sample: MagSample) -> bool:
        """Take a field, of no use once there was an attitude; returns what note_odometry does."""
        if self._attitude is not None or not self._segment_ends(sample.time_us):
            return False
        strength = float(np.linalg.norm(sample.field))
        if not strength:
            return False
        begin, self._field = self._field, sample.field / strength
        felt = self._next_segment(sample.time_us)
        if begin is None or felt is None:
            return False
        across = felt - begin * float(begin @ felt)
        return self._add(cross(self._field, begin), across, 'the magnetic field')

    def _segment_ends(self, time_us: int) -> bool:
        return not 0 <= time_us - self._begin_us < SEGMENT_US

    def _next_segment(self, time_us: int) -> Array | None:
        """Return the turn (3,) that was felt over a segment, None where it was none."""
        elapsed_us, self._begin_us = time_us - self._begin_us, time_us
        felt, self._felt = self._felt, np.zeros(3)
        return felt if 0 < elapsed_us < LONGEST_US else None

    def _add(self, seen: Array, felt: Array, by: str) -> bool:
        self._turns.append((seen, felt))
        if len(self._turns) < SEGMENTS:
            return False
        turns, self._turns = np.array(self._turns), []
        net_turn = float(np.linalg.norm(turns[:, 0].sum(axis=0)))
        turns -= turns.mean(axis=0)
        seen_power, felt_power = np.sum(turns ** 2, axis=(0, 2)).tolist()
        shared = float(np.sum(turns[:, 0] * turns[:, 1]))
        if not felt_power and net_turn > LEAST_TURN:
            self._conclude(
                f'the imu does not turn, {by} does: its angular_velocity must be measured')
        elif abs(shared) > IN_STEP * math.sqrt(seen_power * felt_power):
            self._conclude(_judgement(shared / seen_power, by))
        return bool(self.sentence)

    def _conclude(self, sentence: str) -> None:
        self.open, self.sentence = False, sentence


def _judgement(scale: float, by: str) -> str:
    """Say what is wrong with a gyro that turns `scale` times as far as something else."""
    if not 1.0 / TIMES < abs(scale) < TIMES:
        return (f'the imu turns {abs(scale):.2g} times as far as {by}: its angular_velocity must '
                'be in rad/s, one in deg/s turns 57 times as far')
    if scale < 0.0:
        return (f'the imu turns the other way than {by}: its angular_velocity has wrong signs, or '
                'one of the two sits turned, set its mount_rpy')
    return ''
