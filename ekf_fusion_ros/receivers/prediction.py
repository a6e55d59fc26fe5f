"""Where the fixes should be: the common time base and frame of several receivers."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.geo.projection import Projection
from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.mathlib.rotation import cross
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import Antenna
from ekf_fusion_ros.samples import GnssSample

Array = NDArray[np.float64]


SHORT_US = 1_500_000
RESET_DISTANCE = 5.0
"""More than acceleration moves a vehicle within the interval of fixes, in m."""


class Place(NamedTuple):
    """Position of an antenna on the earth (deg, deg, m) and its velocity NED (3,) m/s."""

    lat: float
    lon: float
    alt: float
    velocity: Array


class Prediction:
    """The motion of the vehicle about now, from the estimate or, before there is one, from a fix.

    Deviations from it can be compared and averaged although the fixes are of different times and
    antennas. `trusted` where it is the estimate; sigma (3,): its 1-sigma of horizontal position,
    height and velocity in m and m/s.
    """

    def __init__(self, nav: NavState | None, fix: GnssSample, delay_us: int,
                 projection: str) -> None:
        """Predict from a state of time `nav.time_us`; a fix measured delay_us before its stamp."""
        self._projection = projection
        self.trusted = False
        self.sigma: tuple[float, ...]
        if nav is not None and nav.origin is not None and nav.yaw_aligned and nav.gnss_started:
            self._from_estimate(nav, nav.origin)
        else:
            self._from_fix(fix, fix.time_us - delay_us)

    def _from_estimate(self, nav: NavState, origin: GeoPoint) -> None:
        self.trusted = True
        variances = (max(nav.pose_cov[0, 0], nav.pose_cov[1, 1]), nav.pose_cov[2, 2],
                     nav.velocity_cov.diagonal().max())
        self.sigma = tuple(math.sqrt(variance) for variance in variances)
        self._origin = origin
        self._time_us = nav.time_us
        self._position, self._velocity = nav.position, nav.velocity
        self._rotation, self._rate = matrix_from_quat(nav.quaternion), nav.angular_rate

    def _from_fix(self, fix: GnssSample, time_us: int) -> None:
        """Start at a fix. Where the antennas are against it is not known without attitude."""
        self.sigma = (math.inf, math.inf, math.inf)
        self._origin = GeoPoint(fix.lat, fix.lon, fix.alt)
        self._time_us = time_us
        self._position = np.zeros(3)
        self._velocity = fix.velocity if fix.has_velocity else np.zeros(3)
        self._rotation, self._rate = np.zeros((3, 3)), np.zeros(3)

    def deviation(self, fix: GnssSample, time_us: int, antenna: Array) -> Array:
        """Return (6,): position NED in m and velocity NED in m/s of a fix against this.

        It was measured at time_us at an antenna (3,) in the body; velocity NaN without one.
        """
        north, east = self._about_origin().project(fix.lat, fix.lon)
        position = np.array((north, east, self._origin.alt - fix.alt))
        arms = Antenna(antenna, antenna, antenna)
        return np.concatenate((
            position - self._antenna_position(time_us, arms),
            fix.velocity - self._antenna_velocity(arms) if fix.has_velocity else NAN3))

    def jump_since(self, before: Prediction) -> Array:
        """Return by how much (3,) NED in m the estimate was reset since; zero without a reset."""
        elapsed_us = self._time_us - before._time_us
        if not (self.trusted and before.trusted and self._origin == before._origin
                and 0 <= elapsed_us <= SHORT_US):
            return np.zeros(3)
        jump = self._position - before._position - before._velocity * (1e-6 * elapsed_us)
        size = np.array(2 * [np.linalg.norm(jump[0:2])] + [abs(jump[2])])
        reset: Array = np.where(size > RESET_DISTANCE, jump, 0.0)
        return reset

    def place(self, deviation: Array, time_us: int, arms: Antenna) -> Place:
        """Return the place at which a fix of time_us would deviate (6,) by so much."""
        north, east, down = (self._antenna_position(time_us, arms) + deviation[0:3]).tolist()
        lat, lon = self._about_origin().reproject(north, east)
        velocity = self._antenna_velocity(arms) + deviation[3:6]
        return Place(lat, lon, self._origin.alt - down, velocity)

    def _about_origin(self) -> Projection:
        return make_projection(
            self._projection, self._origin.lat, self._origin.lon, self._origin.alt)

    def _antenna_position(self, time_us: int, arms: Antenna) -> Array:
        body = self._position + self._velocity * (1e-6 * (time_us - self._time_us))
        arm = self._rotation @ arms.position
        arm[2] = (self._rotation @ arms.height)[2]
        moved: Array = body + arm
        return moved

    def _antenna_velocity(self, arms: Antenna) -> Array:
        swing: Array = self._velocity + self._rotation @ cross(self._rate, arms.velocity)
        return swing
