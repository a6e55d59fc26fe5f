"""How far odometry drifts by the path it goes, measured against fixes."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
import math
from typing import NamedTuple

import numpy as np

from ekf_fusion_ros.params.two_topic import DriftParams
from ekf_fusion_ros.samples import DriftSample

SECOND = 1_000_000
BRIDGE = 6.0
"""A random walk over a path L departs from its mean by the variance d^2 L / 6."""

POINTS_MAX = 100
"""Number of points along the path of a fit; one who stands adds none."""

NEWS = 1.1
"""Ratio of two results from which the later one is worth telling."""

LEAST_SHARE = 0.1
"""Share of what a fit leaves that is not put down to white noise."""

MEMORY = 4.0
"""Paths of the fit over which the largest result counts: slip comes and goes."""


class _Point(NamedTuple):
    """Path m at a time; mean positions, each in its own frame, north + i east in m.

    Of what was averaged: variances (m^2, both axes) of the means of either, and their covariance.
    """

    time_us: int
    path: float
    odometry: complex
    fix: complex
    variance: float
    covariance: complex


class OdometryDrift:
    """An upper bound of the random walk of odometry in m/sqrt(m).

    Over the last `path` metres the odometry is turned and shifted onto the fixes. What is left,
    but for the noise that shows from one fix to the next, is drift of the one or slow error of
    the other. All of it is taken for drift, so that nothing needs to be known of the fixes. A
    point counts once it is `hold` old: fixes that are wrong for less do not open the gates for
    themselves.
    """

    def __init__(self, params: DriftParams) -> None:
        """Start without a result."""
        self._params = params
        self._held: deque[_Point] = deque()
        self._points: deque[_Point] = deque()
        self._results: deque[tuple[float, float]] = deque()
        self._told = math.inf

    def note(
        self, time_us: int, path: float, odometry: Sequence[complex], fixes: Sequence[complex],
    ) -> None:
        """Take pairs of positions around a time, which belong together, and the path m so far."""
        self._held.append(_mean(time_us, path, odometry, fixes))
        old_us = time_us - self._params.hold * SECOND
        while self._held and self._held[0].time_us <= old_us:
            self._add(self._held.popleft())

    def forget(self) -> None:
        """Begin again: the odometry is not what it was."""
        self._held.clear()
        self._points.clear()
        self._results.clear()

    def news(self, now_us: int) -> DriftSample | None:
        """Return the result where it has changed since it was asked for last."""
        walk = max((walk for _, walk in self._results), default=math.inf)
        if walk == self._told or 1.0 / NEWS < walk / self._told < NEWS:
            return None
        self._told = walk
        return DriftSample(now_us, walk)

    def _add(self, point: _Point) -> None:
        points, wanted = self._points, self._params.path
        if points and point.path - points[-1].path < wanted / POINTS_MAX:
            return
        points.append(point)
        while len(points) > 1 and point.path - points[1].path >= wanted:
            points.popleft()
        span = point.path - points[0].path
        if span < wanted:
            return
        seen = math.sqrt(BRIDGE * self._unexplained() / span)
        self._results.append((point.path, self._params.factor * seen))
        while self._results[0][0] < point.path - MEMORY * wanted:
            self._results.popleft()

    def _unexplained(self) -> float:
        """Return the variance (m^2, of either axis) that rigid fit and white noise leave."""
        _, _, odometry, fix, variance, covariance = (
            np.array(column) for column in zip(*self._points, strict=True))
        odometry, fix = odometry - odometry.mean(), fix - fix.mean()
        match = complex(np.vdot(odometry, fix))
        # Fixes that stand still agree with no turn: any leaves all that the odometry has moved.
        turn = match / abs(match) if match else 1.0 + 0j
        left = float(np.mean(np.abs(fix - turn * odometry) ** 2))
        white = float(np.mean(variance - 2.0 * (np.conj(turn) * covariance).real))
        return max(left - white, LEAST_SHARE * left) / 2.0


def _mean(
    time_us: int, path: float, odometry: Sequence[complex], fixes: Sequence[complex],
) -> _Point:
    own, fix = np.array(odometry), np.array(fixes)
    count, own_mean, fix_mean = len(own), complex(own.mean()), complex(fix.mean())
    own, fix = own - own_mean, fix - fix_mean
    known = 1.0 / (count * (count - 1)) if count > 1 else 0.0
    variance = known * float(np.vdot(own, own).real + np.vdot(fix, fix).real)
    return _Point(time_us, path, own_mean, fix_mean, variance, known * complex(np.vdot(own, fix)))
