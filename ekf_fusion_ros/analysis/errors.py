"""Errors of tracks against the truth."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Positions (N, 3) m at times (N,) s, in one common frame with z up or down."""

    time: Array
    position: Array

    def at(self, times: Array) -> Array:
        """Return positions (M, 3) interpolated linearly; the ends are held."""
        columns = [np.interp(times, self.time, self.position[:, k]) for k in range(3)]
        return np.stack(columns, axis=1)

    def held(self, times: Array) -> Array:
        """Return at each time the newest position known then (M, 3); the first before that."""
        newest = np.searchsorted(self.time, times, side='right') - 1
        return self.position[np.maximum(newest, 0)]

    def where(self, mask: NDArray[np.bool_]) -> Track:
        """Return the rows that a mask (N,) keeps."""
        return Track(self.time[mask], self.position[mask])


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """A turn about the vertical by yaw rad, x towards y, then a shift (3,) m."""

    yaw: float
    shift: Array

    def apply(self, position: Array) -> Array:
        """Return moved positions (N, 3)."""
        return position @ _about_vertical(self.yaw).T + self.shift


def align(source: Array, target: Array) -> Alignment:
    """Return the turn about the vertical and shift that bring source (N, 3) closest to target.

    Least squares of the distances: S. Umeyama, IEEE PAMI 13 (1991), planar rotation, no scale.
    """
    a = source - source.mean(axis=0)
    b = target - target.mean(axis=0)
    yaw = math.atan2(
        float(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])),
        float(np.sum(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1])))
    shift = target.mean(axis=0) - _about_vertical(yaw) @ source.mean(axis=0)
    return Alignment(yaw, shift)


def horizontal(error: Array) -> Array:
    """Return the horizontal length (N,) of errors (N, 3)."""
    return np.hypot(error[:, 0], error[:, 1])


def rms(lengths: Array) -> float:
    """Return the root mean square of lengths (N,); NaN of none."""
    return float(np.sqrt(np.mean(lengths ** 2))) if len(lengths) else math.nan


def inside(times: Array, windows: tuple[tuple[float, float], ...]) -> NDArray[np.bool_]:
    """Return which times (N,) lie in any of the windows [start, end)."""
    found = np.zeros(len(times), dtype=bool)
    for begin, end in windows:
        found |= (times >= begin) & (times < end)
    return found


def _about_vertical(yaw: float) -> Array:
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
