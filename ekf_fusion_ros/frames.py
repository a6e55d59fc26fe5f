"""ENU/FLU and NED/FRD: the conversions of MAVROS's odometry plugin, and the frame-name rule.

Earth frames: R swaps x and y and negates z (ENU <-> NED). Body frames: A negates y and z
(FLU <-> FRD). Both are their own inverses, so each function converts either way. With
q the rotation body -> earth and C a covariance, row-major as in ROS messages,

    p' = R p,   v' = A v,   q' = R q A',   C_pose' = blkdiag(R, R) C blkdiag(R, R)',
    C_twist' = blkdiag(A, A) C blkdiag(A, A)'.

MAVROS (mavros_extras, odom.cpp; uas, ftf_frame_conversions.cpp) rotates the rotational block of
the pose covariance with the parent frame too. Quaternions are [w, x, y, z].
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NED_ENU = np.array(((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
FRD_FLU = np.diag((1.0, -1.0, -1.0))
NED_ENU.flags.writeable = False
FRD_FLU.flags.writeable = False

_HALF_SQRT = math.sqrt(0.5)


def frame_kind(frame_id: str) -> str:
    """Return 'ned' or 'frd' for a name that ends in _ned or _frd, 'enu' for any other.

    For a child frame 'ned' and 'frd' both mean forward-right-down, 'enu' forward-left-up.
    """
    if frame_id.endswith('_ned'):
        return 'ned'
    if frame_id.endswith('_frd'):
        return 'frd'
    return 'enu'


def swap_enu_ned(vector: Array) -> Array:
    """Return a vector (3,) of ENU in NED or the other way."""
    x, y, z = vector.tolist()
    return np.array((y, x, -z))


def swap_flu_frd(vector: Array) -> Array:
    """Return a vector (3,) of FLU in FRD or the other way."""
    x, y, z = vector.tolist()
    return np.array((x, -y, -z))


def swap_yaw_enu_ned(yaw: float) -> float:
    """Return a yaw from east, counter-clockwise, as one from north, clockwise, or back.

    rad, within [-pi, pi).
    """
    return (1.5 * math.pi - yaw) % (2.0 * math.pi) - math.pi


def swap_attitude(quaternion: Array) -> Array:
    """Return FLU -> ENU (4,) as FRD -> NED or the other way: R q A'."""
    w, x, y, z = quaternion.tolist()
    return _HALF_SQRT * np.array((w + z, x + y, x - y, w - z))


def swap_attitude_parent(quaternion: Array) -> Array:
    """Return body -> ENU (4,) as body -> NED or the other way, same body axes: R q."""
    w, x, y, z = quaternion.tolist()
    return _HALF_SQRT * np.array((-x - y, w + z, w - z, y - x))


def swap_attitude_child(quaternion: Array) -> Array:
    """Return FLU -> earth (4,) as FRD -> earth or the other way, same earth axes: q A'."""
    w, x, y, z = quaternion.tolist()
    return np.array((-x, w, z, -y))


def rotate_covariance(covariance: Array, rotation: Array) -> Array:
    """Return C' = T C T' for C (3, 3) with T the rotation, or (6, 6) with T = blkdiag of two."""
    if covariance.shape == (3, 3):
        return np.asarray(rotation.dot(covariance).dot(rotation.T))
    turned = np.empty((6, 6))
    for row in (slice(0, 3), slice(3, 6)):
        for column in (slice(0, 3), slice(3, 6)):
            turned[row, column] = rotation @ covariance[row, column] @ rotation.T
    return turned
