"""External vision: takes the odometry sample behind the horizon and hands it to its parts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.buffer import SampleBuffer
from ekf_fusion_ros.ekf2.aid_sources.vision_heading import VisionHeading
from ekf_fusion_ros.ekf2.aid_sources.vision_position import VisionPosition
from ekf_fusion_ros.ekf2.aid_sources.vision_velocity import VisionVelocity
from ekf_fusion_ros.ekf2.aid_sources.vision_yaw import VisionYaw
from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.gnss_checks import GnssChecks
from ekf_fusion_ros.ekf2.heading import HeadingFusion
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.state import FILTER_PERIOD_US
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.mathlib.rotation import relative_rotation
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]

RECENT_US = 400_000
DATA_TIMEOUT_US = 7 * SECOND


class Vision:
    """Buffers samples, keeps the rotation from the odometry to the filter frame, steps parts."""

    def __init__(self, f: Filter, resets: Resets, heading: HeadingFusion, capacity: int) -> None:
        """Act on a filter through its resets and heading fusion."""
        self._f = f
        self.buffer: SampleBuffer[VisionSample] = SampleBuffer(capacity)
        self.popped = False
        self.delayed_us = 0
        self.position = VisionPosition(f, resets)
        self.velocity = VisionVelocity(f, resets)
        self.yaw = VisionYaw(f, resets, heading)
        self.heading = VisionHeading(f, resets)

    def push(self, sample: VisionSample, min_interval_us: int) -> None:
        """Queue a sample unless it follows the last one too closely."""
        if not self.buffer.admits(sample.time_us, min_interval_us):
            return
        delay_us = round(self._f.params.vision.delay_ms * 1000) + FILTER_PERIOD_US // 2
        self.buffer.push(sample.time_us - delay_us, sample)

    def pop(self) -> None:
        """Take the sample at the horizon."""
        popped = self.buffer.pop_first_older_than(self._f.t_horizon)
        self.popped = popped is not None
        if popped is not None:
            self.delayed_us, self._f.vision = popped

    def step(self, checks: GnssChecks, yaw_forbidden: bool) -> None:
        """Run once per filter period."""
        if self.popped:
            self._use(checks.healthy, yaw_forbidden)
            return
        f = self._f
        flags = f.flags
        active = flags.ev_pos or flags.ev_vel or flags.ev_yaw
        if active and f.late(self.buffer.last_arrival_us, DATA_TIMEOUT_US):
            self.position.stop()
            self.velocity.stop()
            flags.ev_yaw = False
            f.events.add(f.t_now, EventKind.VISION_STOPPED)

    def _use(self, gnss_healthy: bool, yaw_forbidden: bool) -> None:
        f = self._f
        sample, params, flags = f.vision, f.params.vision, f.flags
        assert sample is not None
        if yaw_forbidden:
            flags.ev_yaw = False
        rotates = params.rotate and (params.use_position or params.use_velocity)
        if rotates and not flags.ev_yaw and sample.has_attitude:
            f.rot_ev = relative_rotation(f.x[0:4], sample.quaternion)
            self.heading.step(sample)
        recent = f.recent(self.buffer.last_arrival_us, RECENT_US)
        if recent and flags.tilt_align and flags.yaw_align:
            if params.use_position and not flags.ev_pos and sample.has_position:
                self.position.start()
            if params.use_velocity and not flags.ev_vel and sample.has_velocity:
                self.velocity.start(gnss_healthy)
        may_start_yaw = (params.use_yaw and not yaw_forbidden and flags.tilt_align
                         and sample.has_attitude)
        if may_start_yaw and recent and not flags.ev_yaw:
            self.yaw.start(sample)
        if flags.ev_pos and sample.has_position:
            sample = self._at_imu(sample)
            f.vision = sample
            self.position.fuse(sample, gnss_healthy)
        if flags.ev_vel and sample.has_velocity:
            self.velocity.fuse(sample, gnss_healthy)
        if flags.ev_yaw and sample.has_attitude:
            self.yaw.fuse(sample)

    def _at_imu(self, sample: VisionSample) -> VisionSample:
        """Move the position from the vision sensor to the IMU."""
        f = self._f
        if f.vision_lever is None:
            return sample
        return sample._replace(position=sample.position - f.rot @ f.vision_lever)

