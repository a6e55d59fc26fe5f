"""Position from odometry: absolute without GNSS, as displacement since the last sample with it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.fusion import fuse_horizontal_position
from ekf_fusion_ros.ekf2.fusion import fuse_horizontal_velocity
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.kernels.vision import turn_displacement
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]

NOISE_FLOOR = 1e-4
OTHER_AID_US = SECOND


class VisionPosition:
    """Starts with a reset to the odometry, fuses, resets after a time-out, stops with the data."""

    def __init__(self, f: Filter, resets: Resets) -> None:
        """Act on a filter through its resets."""
        self._f = f
        self._resets = resets
        self._previous: VisionSample | None = None
        self._velocity_resets = 0

    def start(self) -> None:
        """Use position from now on."""
        f = self._f
        f.flags.ev_pos = True
        f.events.add(f.t_now, EventKind.VISION_POS_STARTED)
        if not f.flags.gps:
            self._resets.position_to_aiding()
        self._previous = None

    def stop(self) -> None:
        """Stop using position."""
        f = self._f
        f.flags.ev_pos = False
        f.observations.ev_hor_pos.clear(f.t_now)
        self._previous = None

    def fuse(self, sample: VisionSample, gnss_healthy: bool) -> None:
        """Fuse a sample whose position (3,) is that of the IMU."""
        if self._f.params.gnss.enabled:
            self._fuse_displacement(sample)
        else:
            self._fuse_absolute(sample, gnss_healthy)

    def _fuse_absolute(self, sample: VisionSample, gnss_healthy: bool) -> None:
        f = self._f
        position = np.nan_to_num(sample.position)
        covariance = np.diag(np.nan_to_num(sample.position_var))
        if f.params.vision.rotate:
            position = f.rot_ev @ position
            covariance = f.rot_ev @ covariance @ f.rot_ev.T
        innovation = (f.x[7:9] - position[0:2]).tolist()
        noise = np.maximum(np.diag(covariance)[0:2], NOISE_FLOOR).tolist()
        if f.late(f.times.hor_pos, round(f.params.aiding.reset_timeout * SECOND)):
            if f.late(f.times.flow, OTHER_AID_US) and f.late(f.times.hor_vel, OTHER_AID_US):
                self._resets.velocity_to_aiding(gnss_healthy)
            self._resets.position_to_aiding()
        fuse_horizontal_position(f, f.observations.ev_hor_pos, innovation, noise,
                                 f.params.vision.pos_gate)

    def _fuse_displacement(self, sample: VisionSample) -> None:
        """Fuse the mean velocity over the interval between two samples.

        A displacement says nothing about where the vehicle is; taken as a position it would make P
        too small by each sample. Divided by its interval it is a velocity, and its noise that of
        two positions.
        """
        f = self._f
        previous, self._previous = self._previous, sample
        north, east = f.travel.tolist()
        f.travel[:] = 0.0
        velocity_resets = self._resets.counters.vel_ne
        jumped = velocity_resets != self._velocity_resets
        self._velocity_resets = velocity_resets
        if previous is None or jumped or sample.time_us <= previous.time_us:
            return
        interval = 1e-6 * (sample.time_us - previous.time_us)
        moved_north, moved_east, north_var, east_var = turn_displacement(
            f.rot_ev, sample.position, sample.position_var, previous.position,
            previous.position_var)
        innovation = (north - moved_north) / interval, (east - moved_east) / interval
        noise = (max(north_var / interval ** 2, NOISE_FLOOR),
                 max(east_var / interval ** 2, NOISE_FLOOR))
        fuse_horizontal_velocity(f, f.observations.ev_hor_pos, innovation, noise,
                                 f.params.vision.pos_gate)
