"""The seam between an estimator and everything around it."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import replace
from enum import IntEnum
import math
from typing import Any
from typing import NamedTuple
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.samples import Sample

Array = NDArray[np.float64]

YAW_KNOWN_VARIANCE = math.radians(30.0) ** 2
"""Variance of a given yaw below which it aligns the filter."""


@dataclass(frozen=True, slots=True)
class GeoPoint:
    """Latitude and longitude in deg, altitude in m in the datum of the fixes."""

    lat: float
    lon: float
    alt: float

    @property
    def on_earth(self) -> bool:
        """True for a latitude, longitude and altitude that exist."""
        return abs(self.lat) <= 90.0 and abs(self.lon) <= 180.0 and math.isfinite(self.alt)

    def completed(self, alt: float) -> GeoPoint:
        """Return this point, at `alt` where its own altitude is NaN: left open."""
        return replace(self, alt=alt) if math.isnan(self.alt) else self


@dataclass(frozen=True, slots=True, eq=False)
class GivenPose:
    """Where an operator says that the body origin is now, in the local frame.

    position (3,) NED m, yaw rad from north, clockwise; variances position_var (3,) m^2, yaw_var
    rad^2. A component without variance (0) is not given: the estimate of it stays. Roll and pitch
    are never given: gravity tells them.
    """

    position: Array
    position_var: Array
    yaw: float
    yaw_var: float


class NavState(NamedTuple):
    """Navigation state of the body origin predicted to `time_us`, NED/FRD, SI.

    quaternion (4,) w, x, y, z body to earth; velocity (3,), position (3,) NED; angular_rate (3,)
    body rad/s, bias removed; acceleration (3,) NED m/s^2 at the inertial sensor, gravity and bias
    removed. pose_cov (6, 6): position
    NED then small rotations about the earth axes; velocity_cov (3, 3) NED. Covariances are those
    of the fusion horizon. gnss_started: fixes have been fused at least once, so that position is
    one on the earth. in_air: the vehicle is taken to be off the ground, a rover to be moving.
    yaw_jump: sum of the resets of yaw since the start, rad. wind (2,) NE m/s with covariance
    wind_cov (2, 2), ground_down: down position of the ground below in m with its variance in m^2;
    None while they are not estimated.
    """

    time_us: int
    quaternion: Array
    velocity: Array
    position: Array
    angular_rate: Array
    pose_cov: Array
    velocity_cov: Array
    gyro_bias: Array
    accel_bias: Array
    origin: GeoPoint | None
    yaw_aligned: bool
    dead_reckoning: bool
    local_position_valid: bool
    global_position_valid: bool
    gnss_started: bool = True
    in_air: bool = False
    yaw_jump: float = 0.0
    acceleration: Array | None = None
    wind: Array | None = None
    wind_cov: Array | None = None
    ground_down: float | None = None
    ground_variance: float = 0.0


@dataclass(frozen=True, slots=True)
class AidStatus:
    """Latest verdict on one kind of observation, named as PX4 names its aid sources.

    Vectors hold one entry per component. `test_ratio` is innovation^2 / (gate^2 variance).
    Counters run from the start of the estimator.
    """

    name: str
    active: bool
    time_us: int
    innovation: tuple[float, ...]
    innovation_variance: tuple[float, ...]
    test_ratio: float
    innovation_rejected: bool
    fused: int
    rejected: int
    first_fused_us: int
    last_fused_us: int
    starts: int
    stops: int


@dataclass(frozen=True, slots=True)
class Event:
    """Something worth telling: time and one sentence."""

    time_us: int
    text: str


class HealthLevel(IntEnum):
    """Severity, numbered as diagnostic_msgs does."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True, slots=True)
class Health:
    """Level, one sentence, and the numbers behind it (for diagnostics)."""

    level: HealthLevel
    text: str
    values: Mapping[str, str]


class Estimator(Protocol):
    """What a session needs of an estimator."""

    def push(self, sample: Sample) -> None:
        """Queue a measurement; IMU samples drive time."""

    def update(self) -> bool:
        """Process the pushed IMU sample; True when the filter state advanced."""

    def nav_state(self) -> NavState | None:
        """Return the state predicted to the newest IMU sample, None before initialisation."""

    def aid_statuses(self) -> Sequence[AidStatus]:
        """Return one record per kind of observation seen so far."""

    def passed_over(self) -> Mapping[type, Mapping[str, int]]:
        """Return by type and reason how many samples since the start had no effect."""

    def reset_counts(self) -> Mapping[str, int]:
        """Return how often each part of the state has jumped since the start."""

    def drain_events(self) -> Sequence[Event]:
        """Return and forget the events since the last call."""

    def health(self) -> Health:
        """Say in one sentence what the estimator is doing."""

    def set_origin(self, origin: GeoPoint) -> bool:
        """Move the origin of the local frame; False where the point is unusable."""

    def adopt(self, params: Any) -> None:
        """Go on with other parameters of its kind: other live ones, untried mountings."""

    def set_pose(self, pose: GivenPose) -> bool:
        """Jump to a pose; False before there is a state that could jump."""

    def reset(self) -> None:
        """Forget everything but the parameters."""
