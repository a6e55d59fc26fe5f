"""Heading of the odometry frame against ENU, as the filter holds it."""

from __future__ import annotations

import math

from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import yaw_321
from ekf_fusion_ros.samples import VisionSample


class OdometryHeading:
    """Compares the attitude of the filter with that of the newest odometry message."""

    def __init__(self) -> None:
        self._newest: VisionSample | None = None

    @property
    def known(self) -> bool:
        """True once an odometry sample has come."""
        return self._newest is not None

    @property
    def has_attitude(self) -> bool:
        """True where the newest odometry sample tells how the body lies in its frame."""
        return self._newest is not None and self._newest.has_attitude

    @property
    def lack(self) -> str:
        """Sentence on what odometry alone leaves open, '' where it has an orientation."""
        newest = self._newest
        if newest is None or newest.has_attitude:
            return ''
        if newest.has_position:
            return ('the odometry has no orientation: roll, pitch and yaw of the output are those '
                    'of its frame, not of the vehicle')
        return ('the odometry has neither position nor orientation: its twist alone tells no '
                'direction; let pose.covariance say that the orientation is measured')

    def push(self, sample: VisionSample) -> None:
        """Note an odometry sample."""
        self._newest = sample

    def estimate(self, nav: NavState) -> tuple[float, float] | None:
        """Return (odom_yaw, sigma) in rad with p_enu = Rz(odom_yaw) p_odom, None before data."""
        newest = self._newest
        if newest is None:
            return None
        # Without an attitude the axes of the odometry are the body's.
        measured = yaw_321(matrix_from_quat(newest.quaternion)) if newest.has_attitude else 0.0
        # The two attitudes differ by their stamps; the body rate bridges the gap.
        rot = matrix_from_quat(nav.quaternion)
        rate = float(rot[2] @ nav.angular_rate)
        yaw = yaw_321(rot) - rate * (nav.time_us - newest.time_us) * 1e-6
        odom_yaw = math.remainder(measured - yaw, 2.0 * math.pi)
        return odom_yaw, math.sqrt(max(0.0, float(nav.pose_cov[5, 5])))
