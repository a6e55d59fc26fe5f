"""Whether the twist of the odometry lies in the body: some sources give it along their frame."""

from __future__ import annotations

import math

from ekf_fusion_ros.mathlib.rotation import turned
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.samples import VisionSample

SEGMENT_US = 1_000_000
"""Over so long a vehicle goes further than the noise of a position."""

LONGEST_STEP_US = 500_000
PATH_MIN, PATH_MAX = 15.0, 300.0
"""Path in m that the check needs, and after which it rests."""

IN_STEP, OUT_OF_STEP = 0.95, 0.8

SENTENCES = {
    'child': 'the twist of the odometry follows its positions along the axes of header.frame_id, '
             'not of the body: set messages.odometry.twist_frame to parent',
    'parent': 'the twist of the odometry follows its positions along the axes of the body, not of '
              'header.frame_id: set messages.odometry.twist_frame to child'}
"""What is wrong, by where the twist is taken to lie. Turned into the body once too often, it is as
coherent with the positions, mirrored, as one that should have been turned."""


class TwistCheck:
    """Compares displacements by position with those by twist, in the body and as it stands.

    Displacements are complex numbers, and coherence, the size of their normalised product, does
    not see a constant turn between two frames. On a straight way both are coherent; after turns
    only the one that is true.
    """

    def __init__(self, twist_frame: str = 'child') -> None:
        """Start without a message; twist_frame is messages.odometry.twist_frame."""
        self._twist_frame = twist_frame
        self.open = True
        self.sentence = ''
        self._path = 0.0
        self._positions = self._turned_power = self._plain_power = 0.0
        self._turned_product = self._plain_product = self._mirrored_product = 0j
        self._begin: VisionSample | None = None
        self._last: VisionSample | None = None
        self._turned = self._plain = 0j

    def note(self, sample: VisionSample, *, jumped: bool) -> bool:
        """Take an odometry message; True where it completes the check and something is wrong.

        jumped: its frame is not the one of the message before.
        """
        begin, last, self._last = self._begin, self._last, sample
        usable = (sample.has_position and sample.has_velocity and sample.has_attitude
                  and sample.velocity_frame is VelocityFrame.BODY_FRD)
        if not usable or jumped or begin is None or last is None \
                or sample.time_us - last.time_us > LONGEST_STEP_US:
            self._restart(sample if usable else None)
            return False
        dt = 1e-6 * (sample.time_us - last.time_us)
        north, east, _ = turned(sample.quaternion, sample.velocity)
        self._turned += dt * complex(north, east)
        self._plain += dt * complex(sample.velocity[0], sample.velocity[1])
        if sample.time_us - begin.time_us < SEGMENT_US:
            return False
        step = sample.position - begin.position
        self._add(complex(step[0], step[1]))
        self._restart(sample)
        return self._judge()

    def _restart(self, begin: VisionSample | None) -> None:
        self._begin = begin
        self._turned = self._plain = 0j

    def _add(self, step: complex) -> None:
        self._path += abs(step)
        self._positions += abs(step) ** 2
        self._turned_power += abs(self._turned) ** 2
        self._plain_power += abs(self._plain) ** 2
        self._turned_product += step * self._turned.conjugate()
        self._plain_product += step * self._plain.conjugate()
        # Axes of an ENU frame are those of NED mirrored.
        self._mirrored_product += step * self._plain

    def _judge(self) -> bool:
        self.open = self._path < PATH_MAX
        if self._path < PATH_MIN:
            return False
        plain = max(abs(self._plain_product), abs(self._mirrored_product))
        in_body = abs(self._turned_product) / self._scale(self._turned_power)
        if in_body < OUT_OF_STEP and plain / self._scale(self._plain_power) > IN_STEP:
            self.open = False
            self.sentence = SENTENCES[self._twist_frame]
        return bool(self.sentence)

    def _scale(self, power: float) -> float:
        return max(math.sqrt(self._positions * power), 1e-9)
