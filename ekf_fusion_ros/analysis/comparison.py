"""Fused, odometry-only and GPS-only tracks of one flight against its truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.analysis.errors import Track
from ekf_fusion_ros.analysis.errors import align
from ekf_fusion_ros.analysis.errors import horizontal
from ekf_fusion_ros.analysis.errors import inside
from ekf_fusion_ros.analysis.errors import rms

Array = NDArray[np.float64]
Window = tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Tracks of one flight, ENU m about one origin, times in s from its start.

    truth and odometry at the rate of the odometry, odometry in a frame of its own; fixes at the
    times of their measurement; fused as it was put out, with its 1-sigma east, north, up (N, 3).
    """

    truth: Track
    odometry: Track
    fixes: Track
    fused: Track
    fused_sigma: Array
    outage: Window

    @property
    def start(self) -> float:
        """Time from which all tracks are judged: the first fused row."""
        return float(self.fused.time[0])

    def aligned_odometry(self) -> Track:
        """Return odometry brought onto the truth by the fixes before the outage, all of them.

        This is the best that the odometry alone can be given: a fit over fixes to come as well.
        """
        before = self.fixes.where(self.fixes.time < self.outage[0])
        fit = align(self.odometry.at(before.time), before.position)
        return Track(self.odometry.time, fit.apply(self.odometry.position))

    def gps_only(self) -> Track:
        """Return the fixes, and inside the outage the last one held.

        A fix is judged at the time of its own measurement: the GPS is charged no delay.
        """
        lost = self.truth.time[inside(self.truth.time, (self.outage,))]
        held = self.fixes.held(lost)
        time = np.concatenate([self.fixes.time, lost])
        order = np.argsort(time, kind='stable')
        return Track(time[order], np.vstack([self.fixes.position, held])[order])

    def errors(self, track: Track) -> Track:
        """Return the errors (N, 3) of a track from `start` on."""
        judged = track.where(track.time >= self.start)
        return Track(judged.time, judged.position - self.truth.at(judged.time))

    def score(self) -> Score:
        """Return the RMS errors of the three tracks."""
        tracks = (self.fused, self.aligned_odometry(), self.gps_only())
        outside, within = zip(*(self._split(self.errors(track)) for track in tracks), strict=True)
        return Score(Rms(*outside), Rms(*within))

    def _split(self, error: Track) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return (horizontal, 3-D) RMS outside and inside the outage."""
        lost = inside(error.time, (self.outage,))
        return _both(error.position[~lost]), _both(error.position[lost])


@dataclass(frozen=True, slots=True)
class Rms:
    """(horizontal, 3-D) RMS errors in m of the three tracks."""

    fused: tuple[float, float]
    odometry: tuple[float, float]
    gps: tuple[float, float]

    def ratio(self, dimension: int) -> float:
        """Return fused over the better single source; 0 horizontal, 1 in three dimensions."""
        return self.fused[dimension] / min(self.odometry[dimension], self.gps[dimension])


@dataclass(frozen=True, slots=True)
class Score:
    """Errors outside and inside the outage."""

    outside: Rms
    inside: Rms

    @property
    def worst_ratio(self) -> float:
        """The larger horizontal ratio; NaN where one is undefined."""
        return float(np.maximum(self.outside.ratio(0), self.inside.ratio(0)))


def _both(error: Array) -> tuple[float, float]:
    return rms(horizontal(error)), rms(np.linalg.norm(error, axis=1))
