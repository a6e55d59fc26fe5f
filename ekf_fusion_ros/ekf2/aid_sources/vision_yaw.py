"""Yaw from odometry in the filter's frame: starts with a reset and stops the compass."""

from __future__ import annotations

import numpy as np

from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.heading import HeadingFusion
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import rolls_more_than_pitches
from ekf_fusion_ros.mathlib.rotation import yaw_312
from ekf_fusion_ros.mathlib.rotation import yaw_321
from ekf_fusion_ros.samples import VisionSample

VARIANCE_FLOOR = 1e-4


class VisionYaw:
    """The local frame of the filter becomes that of the odometry."""

    def __init__(self, f: Filter, resets: Resets, heading: HeadingFusion) -> None:
        """Act on a filter through its resets and heading fusion."""
        self._f = f
        self._resets = resets
        self._heading = heading

    def start(self, sample: VisionSample) -> None:
        """Turn to the yaw of a sample and use it from now on."""
        f = self._f
        yaw = yaw_312(matrix_from_quat(sample.quaternion))
        self._resets.yaw(yaw, max(sample.angular_var, VARIANCE_FLOOR))
        f.rot_ev = np.eye(3)
        f.flags.yaw_align = True
        f.flags.ev_yaw = True
        f.flags.mag_dec = False
        f.flags.mag_hdg = False
        if f.flags.mag_3d:
            f.flags.mag_3d = False
            f.cov.activate_mag(False)
        f.events.add(f.t_now, EventKind.VISION_YAW_STARTED)

    def fuse(self, sample: VisionSample) -> None:
        """Fuse the yaw of a sample, in the rotation sequence the filter's attitude asks for."""
        self._heading.predicted_yaw()
        rot = matrix_from_quat(sample.quaternion)
        measured = yaw_321(rot) if rolls_more_than_pitches(self._f.rot) else yaw_312(rot)
        self._heading.fuse_measured(measured, sample.angular_var)
