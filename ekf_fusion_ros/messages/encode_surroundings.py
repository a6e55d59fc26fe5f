"""Acceleration of the vehicle, and what is around it: wind and ground (ENU/FLU)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros import frames
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat

Array = NDArray[np.float64]
Three = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class VectorFields:
    """A linear vector x, y, z with the covariance (36,) of a message with six components."""

    time_us: int
    linear: Three
    covariance: Array


def encode_acceleration(nav: NavState, sigma: float) -> VectorFields | None:
    """Return the acceleration in the body (FLU), gravity removed, m/s^2; None where unknown.

    `sigma`: noise of the accelerometer in m/s^2. The rotational acceleration is not estimated:
    zeros, with no variance.
    """
    if nav.acceleration is None:
        return None
    body = matrix_from_quat(nav.quaternion).T @ nav.acceleration
    covariance = np.zeros(36)
    covariance[0:15:7] = sigma * sigma
    return VectorFields(nav.time_us, _three(frames.FRD_FLU @ body), covariance)


def encode_wind(nav: NavState) -> VectorFields | None:
    """Return where the air moves to, ENU m/s, level; None while it is not estimated."""
    if nav.wind is None or nav.wind_cov is None:
        return None
    north, east = nav.wind.tolist()
    covariance = np.zeros((6, 6))
    covariance[0:2, 0:2] = nav.wind_cov[::-1, ::-1]
    return VectorFields(nav.time_us, (east, north, 0.0), covariance.ravel())


def encode_ground(nav: NavState) -> Three | None:
    """Return the point of the ground below the vehicle, ENU m; None while it is not known."""
    if nav.ground_down is None:
        return None
    north, east, _ = nav.position.tolist()
    return east, north, -nav.ground_down


def _three(vector: Array) -> Three:
    x, y, z = vector.tolist()
    return x, y, z
