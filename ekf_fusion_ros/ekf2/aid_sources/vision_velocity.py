"""Velocity from odometry: starts with a reset, resets after a time-out, stops with the data."""

from __future__ import annotations

import numpy as np

from ekf_fusion_ros.ekf2.aid_sources.vision_body_velocity import fuse_body_velocity
from ekf_fusion_ros.ekf2.aid_sources.vision_body_velocity import vision_velocity_in_body
from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.fusion import fuse_horizontal_velocity
from ekf_fusion_ros.ekf2.fusion import fuse_vertical_velocity
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.resets import velocity_tells_attitude
from ekf_fusion_ros.ekf2.resets import vision_velocity_in_filter_frame
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.ekf2.state import VN
from ekf_fusion_ros.samples import VisionSample

NOISE_FLOOR = 0.05 ** 2
OTHER_AID_US = SECOND


class VisionVelocity:
    """Velocity in the body or in the odometry frame."""

    def __init__(self, f: Filter, resets: Resets) -> None:
        """Act on a filter through its resets."""
        self._f = f
        self._resets = resets

    def start(self, gnss_healthy: bool) -> None:
        """Use velocity from now on."""
        f = self._f
        f.flags.ev_vel = True
        f.events.add(f.t_now, EventKind.VISION_VEL_STARTED)
        self._resets.velocity_to_aiding(gnss_healthy)

    def stop(self) -> None:
        """Stop using velocity."""
        f = self._f
        f.flags.ev_vel = False
        f.observations.ev_hor_vel.clear(f.t_now)
        f.observations.ev_ver_vel.clear(f.t_now)

    def fuse(self, sample: VisionSample, gnss_healthy: bool) -> None:
        """Fuse the velocity of a sample."""
        f = self._f
        velocity, variance = vision_velocity_in_filter_frame(f, sample)
        innovation = [f.x.item(VN + i) - velocity[i] for i in range(3)]
        if f.late(f.times.hor_vel, round(f.params.aiding.reset_timeout * SECOND)):
            if f.late(f.times.flow, OTHER_AID_US) and f.late(f.times.hor_pos, OTHER_AID_US):
                self._resets.velocity_to_aiding(gnss_healthy)
        noise = [max(v, NOISE_FLOOR) for v in variance]
        f.last_velocity = velocity[0:2]
        f.last_velocity_variance = noise[0:2]
        gate = f.params.vision.vel_gate
        if velocity_tells_attitude(f, sample):
            measured, measured_variance = vision_velocity_in_body(f, sample)
            fuse_body_velocity(f, f.observations.ev_hor_vel, f.observations.ev_ver_vel,
                               measured, np.maximum(measured_variance, NOISE_FLOOR), gate)
            return
        fuse_horizontal_velocity(f, f.observations.ev_hor_vel, innovation[0:2], noise[0:2], gate)
        fuse_vertical_velocity(f, f.observations.ev_ver_vel, innovation[2], noise[2], gate)
