"""States and fixes as the fields of ROS messages (ENU/FLU), for the node and the bag alike.

Nothing here knows rclpy or rosbags: each publisher copies the fields into its own message class.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros import frames
from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.geo.projection import Projection
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.samples import GnssSample

Array = NDArray[np.float64]

UNMEASURED_VARIANCE = 1e6
# The estimator has no covariance of the rate beyond its noise: PX4's EKF2_GYR_NOISE squared.
RATE_VARIANCE = 1.5e-2 ** 2

STATUS_NO_FIX = -1
STATUS_FIX = 0
SERVICE_GPS = 1
COVARIANCE_KNOWN = 3

# Places in the numbers of an Odometry message.
POSITION, ORIENTATION, POSE_COVARIANCE = slice(0, 3), slice(3, 7), slice(7, 43)
LINEAR, ANGULAR, TWIST_COVARIANCE = slice(43, 46), slice(46, 49), slice(49, 85)
ODOMETRY_NUMBERS = 85

# C[i, j] of ENU is +-C[order[i], order[j]] of NED.
_ORDER = np.array((1, 0, 2, 4, 3, 5))
_PICK = 6 * _ORDER[:, None] + _ORDER[None, :]
_SIGN = np.array((1.0, 1.0, -1.0, 1.0, 1.0, -1.0))
_SIGNS = np.outer(_SIGN, _SIGN)
_POSE_PICK, _POSE_SIGN = _PICK.ravel(), _SIGNS.ravel()
_POSITION_PICK, _POSITION_SIGN = _PICK[:3, :3].ravel(), _SIGNS[:3, :3].ravel()


@dataclass(frozen=True, slots=True, eq=False)
class OdometryFields:
    """nav_msgs/Odometry: pose in the parent frame (ENU), twist in the child frame (FLU).

    numbers (85,) in the order of the message: position m; orientation x, y, z, w; covariance;
    linear m/s; angular rad/s; covariance. Covariances (36,) are row-major.
    """

    time_us: int
    frame_id: str
    child_frame_id: str
    numbers: Array

    @property
    def position(self) -> tuple[float, ...]:
        """Position x, y, z."""
        return tuple(self.numbers[POSITION].tolist())

    @property
    def orientation(self) -> tuple[float, ...]:
        """Orientation x, y, z, w."""
        return tuple(self.numbers[ORIENTATION].tolist())

    @property
    def linear(self) -> tuple[float, ...]:
        """Linear velocity x, y, z."""
        return tuple(self.numbers[LINEAR].tolist())

    @property
    def angular(self) -> tuple[float, ...]:
        """Angular velocity x, y, z."""
        return tuple(self.numbers[ANGULAR].tolist())

    @property
    def pose_covariance(self) -> Array:
        """Covariance (36,) of position and orientation."""
        return self.numbers[POSE_COVARIANCE]

    @property
    def twist_covariance(self) -> Array:
        """Covariance (36,) of linear and angular velocity."""
        return self.numbers[TWIST_COVARIANCE]


@dataclass(frozen=True, slots=True, eq=False)
class NavSatFixFields:
    """sensor_msgs/NavSatFix: deg, m; covariance (9,) ENU row-major, m^2."""

    time_us: int
    frame_id: str
    status: int
    service: int
    latitude: float
    longitude: float
    altitude: float
    position_covariance: Array
    position_covariance_type: int


def encode_odometry(nav: NavState, frame_id: str, child_frame_id: str) -> OdometryFields:
    """Return a state as Odometry.

    The velocity covariance is turned into the body by the attitude; the attitude's own
    uncertainty is in the pose.
    """
    return OdometryFields(nav.time_us, frame_id, child_frame_id, odometry_numbers([nav])[0])


def odometry_numbers(navs: Sequence[NavState]) -> Array:
    """Return the numbers of the Odometry messages of n states, (n, 85)."""
    numbers = np.zeros((len(navs), ODOMETRY_NUMBERS))
    position = np.array([nav.position for nav in navs])
    rate = np.array([nav.angular_rate for nav in navs])
    pose_cov = np.array([nav.pose_cov for nav in navs]).reshape(-1, 36)
    numbers[:, POSITION] = position[:, (1, 0, 2)] * (1.0, 1.0, -1.0)
    numbers[:, ORIENTATION] = _orientations(np.array([nav.quaternion for nav in navs]))
    numbers[:, POSE_COVARIANCE] = pose_cov[:, _POSE_PICK] * _POSE_SIGN
    numbers[:, ANGULAR] = rate * (1.0, -1.0, -1.0)
    twist_cov = numbers[:, TWIST_COVARIANCE].reshape(-1, 6, 6)
    for nav, linear, covariance in zip(navs, numbers[:, LINEAR], twist_cov, strict=True):
        to_body = matrix_from_quat(nav.quaternion).T
        linear[:] = to_body.dot(nav.velocity)
        body = frames.FRD_FLU.dot(to_body)
        covariance[:3, :3] = body.dot(nav.velocity_cov).dot(body.T)
    numbers[:, LINEAR] *= (1.0, -1.0, -1.0)
    numbers[:, TWIST_COVARIANCE][:, 21::7] = RATE_VARIANCE
    return numbers


def _orientations(quaternions: Array) -> Array:
    """Return frames.swap_attitude of (n, 4), as x, y, z, w."""
    w, x, y, z = quaternions.T
    return math.sqrt(0.5) * np.stack((x + y, x - y, w - z, w + z), axis=1)


def encode_fix(nav: NavState, projection: Projection, frame_id: str) -> NavSatFixFields:
    """Return a state as NavSatFix, in the altitude datum of the fixes.

    `projection` is the one the estimator uses, about `nav.origin`. The status is 'no fix' while
    the global position is not valid. Raises ValueError where there is no origin.
    """
    if nav.origin is None:
        raise ValueError('a state without origin has no latitude: set the origin first')
    north, east, down = nav.position.tolist()
    lat, lon = projection.reproject(north, east)
    status = STATUS_FIX if nav.global_position_valid else STATUS_NO_FIX
    covariance = nav.pose_cov.ravel()[_POSITION_PICK] * _POSITION_SIGN
    return NavSatFixFields(
        nav.time_us, frame_id, status, SERVICE_GPS, lat, lon, nav.origin.alt - down, covariance,
        COVARIANCE_KNOWN)


def encode_gnss_odometry(
        fix: GnssSample, origin: GeoPoint, projection: Projection, frame_id: str,
        child_frame_id: str = '') -> OdometryFields:
    """Return a fix as Odometry in the frame about `origin`: the position of the antenna.

    Orientation and twist are not measured (variance 1e6), nor is the height of a fix without
    altitude.
    """
    north, east = projection.project(fix.lat, fix.lon)
    has_height = math.isfinite(fix.alt)
    up = fix.alt - origin.alt if has_height else 0.0
    numbers = np.zeros(ODOMETRY_NUMBERS)
    numbers[POSITION] = east, north, up
    numbers[ORIENTATION.stop - 1] = 1.0
    numbers[POSE_COVARIANCE][::7] = UNMEASURED_VARIANCE
    numbers[POSE_COVARIANCE][:14:7] = fix.eph * fix.eph
    if has_height:
        numbers[POSE_COVARIANCE][14] = fix.epv * fix.epv
    numbers[TWIST_COVARIANCE][::7] = UNMEASURED_VARIANCE
    return OdometryFields(fix.time_us, frame_id, child_frame_id, numbers)
