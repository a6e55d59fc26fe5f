"""Heading of the odometry frame against ENU, as the filter holds it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.samples import VisionSample


class OdometryHeading:
    """Compares the attitude of the filter with that of the newest odometry message."""

    def __init__(self) -> None:
        self._time_us = 0
        self._yaw = math.nan

    @property
    def known(self) -> bool:
        """True once an odometry sample has come."""
        return self._time_us > 0

    def push(self, sample: VisionSample) -> None:
        """Note the attitude of an odometry sample; without one its axes are the body's."""
        measured = math.isfinite(sample.quaternion[0])
        self._time_us = sample.time_us
        self._yaw = yaw_of(sample.quaternion) if measured else 0.0

    def estimate(self, nav: NavState) -> tuple[float, float] | None:
        """Return (odom_yaw, sigma) in rad with p_enu = Rz(odom_yaw) p_odom, None before data."""
        if math.isnan(self._yaw):
            return None
        # The two attitudes differ by their stamps; the body rate bridges the gap.
        rate = earth_yaw_rate(nav.quaternion, nav.angular_rate)
        yaw = yaw_of(nav.quaternion) - rate * (nav.time_us - self._time_us) * 1e-6
        odom_yaw = math.remainder(self._yaw - yaw, 2.0 * math.pi)
        return odom_yaw, math.sqrt(max(0.0, float(nav.pose_cov[5, 5])))


def yaw_of(quaternion: NDArray[np.float64]) -> float:
    """Yaw of the 3-2-1 sequence in rad of a quaternion w, x, y, z."""
    w, x, y, z = (float(value) for value in quaternion)
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def earth_yaw_rate(quaternion: NDArray[np.float64], rate: NDArray[np.float64]) -> float:
    """Component of a body rate (3,) along the vertical of the earth frame, rad/s."""
    w, x, y, z = (float(value) for value in quaternion)
    down = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    return sum(component * float(value) for component, value in zip(down, rate, strict=True))
