"""Heading of the odometry frame against north, from displacements of odometry and fixes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.geo.projection import Wgs84Projection
from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.mathlib.rotation import turned
from ekf_fusion_ros.odometry_drift import OdometryDrift
from ekf_fusion_ros.params.two_topic import MotionHeadingParams
from ekf_fusion_ros.params.two_topic import TwoTopicParams
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import HeadingSample
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]

SECOND = 1_000_000
MIN_POINTS = 5
HISTORY_US = 10 * SECOND
CONFIRMATIONS = 3

Held = Callable[[], tuple[float, float] | None]
"""Gives a yaw as in HeadingFit and its sigma, rad; None where none is known."""


@dataclass(frozen=True, slots=True)
class HeadingFit:
    """Rigid 2-D fit of fixes to odometry: v_ned = Rz(yaw) v_odometry.

    yaw, sigma rad; scale of fix displacement against odometry displacement; misfit = RMS of the
    residuals over what the noise model expects.
    """

    time_us: int
    yaw: float
    sigma: float
    scale: float
    misfit: float


@dataclass(frozen=True, slots=True)
class HeadingStatus:
    """What is known: sigma in rad (NaN before a fit), path in m, a sentence."""

    sigma: float
    path: float
    text: str


@dataclass(frozen=True, slots=True)
class _Point:
    """Mean of the pairs inside one interval; positions north + i east in m."""

    time_us: int
    path: float
    odometry: complex
    fix: complex
    variance: float
    count: int


class MotionHeading:
    """Finds the heading by a weighted rigid fit over a window, and keeps watching it.

    The fit is generalised least squares: fixes err by white noise plus a first-order Markov
    process, so that standing still or a high rate adds no false certainty (Brown and Hwang,
    Introduction to Random Signals, chapter on shaping filters). `fix_delay_us` is the delay of
    fixes against odometry stamps.
    """

    def __init__(
        self, params: TwoTopicParams, fix_delay_us: int = 0, drift: OdometryDrift | None = None,
    ) -> None:
        """Start without a fit; `drift` is told of the pairs."""
        self._drift = drift
        self._params: MotionHeadingParams = params.heading
        self._delay_us = fix_delay_us
        self._projection: Wgs84Projection | None = None
        self._track: deque[tuple[int, complex, float]] = deque()
        self._pending: deque[tuple[int, complex, float]] = deque()
        self._pairs: list[tuple[int, float, complex, complex, float]] = []
        self._points: deque[_Point] = deque()
        self._reset_counter: int | None = None
        self._fit: HeadingFit | None = None
        self._announced = math.inf
        self._contradictions = 0

    def push_odometry(self, sample: VisionSample, *, jumped: bool = False) -> None:
        """Take an odometry message.

        `jumped`: the odometry frame is not the one of the message before; a new window begins.
        One without a position is summed up from its velocity; without either the track ends.
        """
        if jumped:
            self._forget_track()
        if self._reset_counter is not None and sample.reset_counter != self._reset_counter:
            self._forget_track()
        self._reset_counter = sample.reset_counter
        place = self._place(sample)
        if place is None:
            self._forget_track()
            return
        path = 0.0
        if self._track:
            before_us, before, path = self._track[-1]
            if sample.time_us <= before_us:
                return
            path += abs(place - before)
        self._track.append((sample.time_us, place, path))
        while len(self._track) > 2 and self._track[1][0] < sample.time_us - HISTORY_US:
            self._track.popleft()

    def _place(self, sample: VisionSample) -> complex | None:
        if sample.has_position:
            return complex(sample.position[0], sample.position[1])
        if not sample.has_velocity:
            return None
        velocity: Sequence[float] = sample.velocity.tolist()
        if sample.velocity_frame is VelocityFrame.BODY_FRD:
            if math.isnan(sample.quaternion[0]):
                return None
            velocity = turned(sample.quaternion, sample.velocity)
        if not self._track:
            return 0j
        before_us, before, _ = self._track[-1]
        dt = (sample.time_us - before_us) / SECOND
        return before + dt * complex(velocity[0], velocity[1])

    def given(self, sigma: float) -> None:
        """Note that the heading in use was given from outside with a sigma in rad.

        It stays until motion knows it better or contradicts it.
        """
        self._announced = min(self._announced, sigma)

    def push_fix(self, sample: GnssSample, held: Held = lambda: None) -> HeadingSample | None:
        """Take a fix; return a heading when there is one to announce.

        `held` returns the heading of the odometry frame that the filter holds.
        """
        if self._projection is None:
            self._projection = Wgs84Projection(sample.lat, sample.lon, sample.alt)
        place = complex(*self._projection.project(sample.lat, sample.lon))
        sigma = max(sample.eph, self._params.fix_noise)
        self._pending.append((sample.time_us - self._delay_us, place, sigma))
        announced = None
        while self._pending and self._track and self._pending[0][0] <= self._track[-1][0]:
            if self._take(*self._pending.popleft()):
                announced = self._announcement(held) or announced
        return announced

    def status(self) -> HeadingStatus:
        """Say how far the alignment is."""
        path = self._points[-1].path - self._points[0].path if self._points else 0.0
        if self._fit is None:
            text = f'aligning yaw from motion: drive {path:.0f} m so far, nothing to match yet'
            return HeadingStatus(math.nan, path, text)
        sigma = min(self._fit.sigma, math.pi)
        words = f'sigma {math.degrees(sigma):.0f} deg, drive {path:.0f} m'
        if math.isfinite(self._announced):
            return HeadingStatus(sigma, path, f'yaw from motion: {words}')
        if not self._consistent(self._fit):
            words += f'; fixes moved {self._fit.scale:.2f} times as far as the odometry'
        return HeadingStatus(sigma, path, f'aligning yaw from motion: {words}')

    # -- pairs of odometry and fix -------------------------------------------------------------

    def _forget_track(self) -> None:
        self._track.clear()
        self._pending.clear()
        self._pairs.clear()
        self._points.clear()
        self._fit = None
        self._contradictions = 0
        if self._drift is not None:
            self._drift.forget()

    def _take(self, time_us: int, place: complex, sigma: float) -> bool:
        """Pair a fix with the track; True when an interval was completed."""
        where = self._odometry_at(time_us)
        if where is None:
            return False
        odometry, path = where
        interval_us = round(self._params.interval * SECOND)
        done = bool(self._pairs) and time_us - self._pairs[0][0] >= interval_us
        if done:
            point = _mean(self._pairs)
            self._points.append(point)
            if self._drift is not None:
                self._drift.note(point.time_us, point.path, [pair[2] for pair in self._pairs],
                                 [pair[3] for pair in self._pairs])
            self._pairs.clear()
            self._trim()
            self._fit = self._fitted()
        self._pairs.append((time_us, path, odometry, place, sigma))
        return done

    def _odometry_at(self, time_us: int) -> tuple[complex, float] | None:
        after = None
        for entry in reversed(self._track):
            if entry[0] <= time_us:
                if after is None:
                    return entry[1], entry[2]
                part = (time_us - entry[0]) / (after[0] - entry[0])
                return (entry[1] + part * (after[1] - entry[1]),
                        entry[2] + part * (after[2] - entry[2]))
            after = entry
        return None

    def _trim(self) -> None:
        """Keep the shortest window that spans the wanted time and path, within the longest."""
        params, points = self._params, self._points
        newest = points[-1]
        while len(points) > MIN_POINTS:
            age = (newest.time_us - points[1].time_us) / SECOND
            path = newest.path - points[1].path
            known = self._fit is not None and self._fit.sigma < params.announce_sigma
            long_enough = known and age >= params.window_time and path >= params.window_path
            if not long_enough and age < params.window_time_max:
                return
            points.popleft()

    # -- the fit -------------------------------------------------------------------------------

    def _fitted(self) -> HeadingFit | None:
        """Minimise (z - c - h p)^H C^-1 (z - c - h p) over c and |h| = 1."""
        points = self._points
        if len(points) < MIN_POINTS:
            return None
        params = self._params
        time = np.array([point.time_us for point in points]) / SECOND
        weight = np.linalg.inv(self._noise(time))
        odometry = np.array([point.odometry for point in points])
        fix = np.array([point.fix for point in points])
        total = weight.sum(axis=0)
        odometry = odometry - (total @ odometry) / total.sum()
        fix = fix - (total @ fix) / total.sum()
        spread = float((odometry.conj() @ weight @ odometry).real)
        if spread < 1e-6:
            return None
        match = complex(odometry.conj() @ weight @ fix)
        if match == 0.0:
            # fixes that do not move at all, as of a receiver that holds its last place
            return None
        residual = fix - odometry * (match / abs(match))
        misfit = math.sqrt(float((residual.conj() @ weight @ residual).real)
                           / (2 * len(points) - 3))
        drift = params.odometry_yaw_drift ** 2 * (time[-1] - time[0])
        sigma = math.sqrt(max(misfit, 1.0) ** 2 / spread + drift)
        return HeadingFit(points[-1].time_us, math.atan2(match.imag, match.real), sigma,
                          abs(match) / spread, misfit)

    def _noise(self, time: Array) -> Array:
        """Return the covariance (n, n) of one component of the points, m^2."""
        params = self._params
        sigma = np.sqrt([point.variance for point in self._points])
        lasting = params.fix_drift_factor * sigma
        apart = np.abs(time[:, np.newaxis] - time) / params.fix_drift_time
        covariance: Array = np.outer(lasting, lasting) * np.exp(-apart)
        counts = np.array([point.count for point in self._points])
        return covariance + np.diag(sigma ** 2 / counts)

    def _consistent(self, fit: HeadingFit) -> bool:
        """Both moved equally far, within what the noise and the odometry's scale allow."""
        sigma = math.hypot(fit.sigma, self._params.odometry_scale_error)
        return abs(fit.scale - 1.0) < 3.0 * sigma

    # -- announcements -------------------------------------------------------------------------

    def _announcement(self, held: Held) -> HeadingSample | None:
        fit = self._fit
        if fit is None or not self._consistent(fit):
            return None
        params = self._params
        wanted = fit.sigma < params.announce_sigma and math.isinf(self._announced)
        wanted |= fit.sigma < params.refine_sigma < self._announced
        if not wanted and not self._contradicted(fit, held):
            return None
        self._announced = fit.sigma
        self._contradictions = 0
        return HeadingSample(fit.time_us, fit.yaw, fit.sigma ** 2)

    def _contradicted(self, fit: HeadingFit, held: Held) -> bool:
        """True once the fit has contradicted the heading in use several times in a row."""
        in_use = None if math.isinf(self._announced) else held()
        if in_use is None:
            return False
        yaw, sigma = in_use
        limit = max(self._params.watch_gate * math.hypot(sigma, fit.sigma),
                    self._params.watch_angle)
        apart = abs(wrap_pi(fit.yaw - yaw)) > limit and fit.sigma < self._params.announce_sigma
        self._contradictions = self._contradictions + 1 if apart else 0
        return self._contradictions >= CONFIRMATIONS


def _mean(pairs: list[tuple[int, float, complex, complex, float]]) -> _Point:
    count = len(pairs)
    time_us = sum(pair[0] for pair in pairs) // count
    return _Point(
        time_us, sum(pair[1] for pair in pairs) / count, sum(pair[2] for pair in pairs) / count,
        sum(pair[3] for pair in pairs) / count, sum(pair[4] ** 2 for pair in pairs) / count, count)
