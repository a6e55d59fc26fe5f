"""What the inputs say against each other: units, signs, sensors that sit turned."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Sequence

from ekf_fusion_ros.down_check import DownCheck
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import VisionSample
from ekf_fusion_ros.turn_check import TurnCheck
from ekf_fusion_ros.twist_check import TwistCheck


class InputChecks:
    """Runs each check until it has come to its conclusion; what is wrong is yielded once."""

    def __init__(self, *, imu: bool, twist_frame: str) -> None:
        """imu: one is in use; twist_frame is messages.odometry.twist_frame.

        `watches_imu` until nothing is left to learn from it.
        """
        self.watches_imu = imu
        self._down = DownCheck(imu=imu)
        self._turn = TurnCheck(imu=imu)
        self._twist = TwistCheck(twist_frame)

    def note_imu(self, increments: Sequence[ImuSample]) -> Iterator[str]:
        """Take increments."""
        if self._turn.open:
            self._turn.note_imu(increments)
        if self._down.open and self._down.note_imu(increments):
            yield self._down.sentence
        self.watches_imu = self._turn.open or self._down.open

    def note_odometry(self, sample: VisionSample, *, jumped: bool) -> Iterator[str]:
        """Take an odometry message; jumped: its frame is not that of the message before."""
        if self._down.open:
            self._down.note_odometry(sample)
        if self._turn.open and self._turn.note_odometry(sample):
            yield self._turn.sentence
        if self._twist.open and self._twist.note(sample, jumped=jumped):
            yield self._twist.sentence

    def note_field(self, sample: MagSample) -> Iterator[str]:
        """Take a magnetic field."""
        if self._turn.open and self._turn.note_field(sample):
            yield self._turn.sentence

    def sentences(self) -> list[str]:
        """Return all that was found wrong."""
        said = (self._down.sentence, self._turn.sentence, self._twist.sentence)
        return [sentence for sentence in said if sentence]
