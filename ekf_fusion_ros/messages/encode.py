"""States and fixes as the fields of ROS messages (ENU/FLU), for the node and the bag alike.

Nothing here knows rclpy or rosbags: each publisher copies the fields into its own message class.
"""

from __future__ import annotations

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
Triple = tuple[float, float, float]

UNMEASURED_VARIANCE = 1e6
# The estimator has no covariance of the rate beyond its noise: PX4's EKF2_GYR_NOISE squared.
RATE_VARIANCE = 1.5e-2 ** 2

STATUS_NO_FIX = -1
STATUS_FIX = 0
SERVICE_GPS = 1
COVARIANCE_KNOWN = 3

# C[i, j] of ENU is +-C[order[i], order[j]] of NED.
_ORDER = np.array((1, 0, 2, 4, 3, 5))
_POSE_PICK = (6 * _ORDER[:, None] + _ORDER[None, :]).ravel()
_SIGN = np.array((1.0, 1.0, -1.0, 1.0, 1.0, -1.0))
_POSE_SIGN = np.outer(_SIGN, _SIGN).ravel()


@dataclass(frozen=True, slots=True, eq=False)
class OdometryFields:
    """nav_msgs/Odometry: pose in the parent frame (ENU), twist in the child frame (FLU).

    position m; orientation x, y, z, w; linear m/s; angular rad/s; covariances (36,) row-major.
    """

    time_us: int
    frame_id: str
    child_frame_id: str
    position: Triple
    orientation: tuple[float, float, float, float]
    linear: Triple
    angular: Triple
    pose_covariance: Array
    twist_covariance: Array


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
    to_earth = matrix_from_quat(nav.quaternion)
    east, north, up = _enu(nav.position)
    w, x, y, z = frames.swap_attitude(nav.quaternion).tolist()
    forward, right, down = to_earth.T.dot(nav.velocity).tolist()
    p, q, r = nav.angular_rate.tolist()
    twist_covariance = np.zeros((6, 6))
    body = frames.FRD_FLU.dot(to_earth.T)
    twist_covariance[:3, :3] = body.dot(nav.velocity_cov).dot(body.T)
    twist_covariance.flat[21::7] = RATE_VARIANCE
    return OdometryFields(
        nav.time_us, frame_id, child_frame_id, (east, north, up), (x, y, z, w),
        (forward, -right, -down), (p, -q, -r), pose_covariance_enu(nav.pose_cov),
        twist_covariance.ravel())


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
    covariance = pose_covariance_enu(nav.pose_cov).reshape(6, 6)[:3, :3].ravel()
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
    variances = np.full(6, UNMEASURED_VARIANCE)
    variances[:2] = fix.eph * fix.eph
    if has_height:
        variances[2] = fix.epv * fix.epv
    return OdometryFields(
        fix.time_us, frame_id, child_frame_id, (east, north, up), (0.0, 0.0, 0.0, 1.0),
        (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), np.diag(variances).ravel(),
        UNMEASURED_VARIANCE * np.eye(6).ravel())


def pose_covariance_enu(pose_cov: Array) -> Array:
    """Return a pose covariance (6, 6) of NED as (36,) of ENU, row-major."""
    return np.asarray(pose_cov.ravel()[_POSE_PICK] * _POSE_SIGN)


def _enu(vector: Array) -> Triple:
    north, east, down = vector.tolist()
    return east, north, -down
