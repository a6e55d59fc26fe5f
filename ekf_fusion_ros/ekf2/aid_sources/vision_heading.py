"""Heading of the odometry frame, found from motion: aligns yaw, or corrects a wrong one."""

from __future__ import annotations

import math

from ekf_fusion_ros.ekf2.covariance import rotation_vector_variances
from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.mathlib.rotation import relative_rotation
from ekf_fusion_ros.mathlib.rotation import yaw_321
from ekf_fusion_ros.mathlib.rotation import yaw_of
from ekf_fusion_ros.samples import HeadingSample
from ekf_fusion_ros.samples import VisionSample


class VisionHeading:
    """Turns the filter so that the odometry frame has the heading that motion has shown."""

    def __init__(self, f: Filter, resets: Resets) -> None:
        """Act on a filter through its resets."""
        self._f = f
        self._resets = resets
        self._waiting: HeadingSample | None = None

    def push(self, sample: HeadingSample) -> None:
        """Take a heading; it is used with the next odometry sample behind the horizon."""
        self._waiting = sample

    def step(self, vision: VisionSample) -> None:
        """Use a waiting heading; f.rot_ev must belong to this odometry sample."""
        f = self._f
        sample = self._waiting
        if sample is None or not f.flags.tilt_align:
            return
        self._waiting = None
        turn = wrap_pi(sample.yaw - yaw_321(f.rot_ev))
        variances = rotation_vector_variances(f.x[0:4], f.cov.p)
        self._resets.yaw(wrap_pi(yaw_of(f.rot) + turn), 0.0)
        variances[2] = sample.variance
        f.cov.set_attitude(f.x[0:4], variances)
        if f.flags.ev_vel:
            self._resets.velocity_to_aiding(False)
        f.rot_ev = relative_rotation(f.x[0:4], vision.quaternion)
        f.flags.yaw_align = True
        f.events.add(f.t_now, EventKind.YAW_ALIGNED_MOTION,
                     f'odometry x axis {-math.degrees(sample.yaw):.0f} deg from east, '
                     f'sigma {math.degrees(math.sqrt(sample.variance)):.0f} deg')
