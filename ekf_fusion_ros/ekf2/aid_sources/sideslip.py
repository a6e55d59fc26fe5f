"""Zero sideslip of a fixed wing: tells the wind, and yaw and velocity where nothing else does."""

from __future__ import annotations

import math

import numpy as np

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.scalar import fuse_scalar
from ekf_fusion_ros.ekf2.scalar import passes
from ekf_fusion_ros.ekf2.wind import Wind
from ekf_fusion_ros.ekf2.wind import recover_covariance
from ekf_fusion_ros.kernels.air_data import observe_sideslip
from ekf_fusion_ros.kernels.air_data import relative_wind
from ekf_fusion_ros.kernels.innovation import project

INTERVAL_US = 150_000
SLOWEST = 7.0
"""Airspeed in m/s above which a fixed wing points into the wind."""


class Sideslip:
    """A synthetic observation in regular intervals, while the vehicle says that it holds."""

    def __init__(self, f: Filter, wind: Wind) -> None:
        """Act on a filter and its wind states."""
        self._f = f
        self._wind = wind
        self._air, self._jacobian = np.zeros(3), np.zeros((3, 24))
        self._h, self._hp = np.zeros(24), np.zeros(24)

    def step(self) -> None:
        """Run once per filter period."""
        f = self._f
        if not f.flags.fuse_beta or not f.flags.in_air or f.holding_position:
            return
        if not f.late(f.times.sideslip, INTERVAL_US):
            return
        if self._wind.start():
            f.times.sideslip = f.t_now
        self._fuse()

    def _fuse(self) -> None:
        f = self._f
        relative_wind(f.x, self._air, self._jacobian)
        if not math.hypot(*self._air.tolist()) > SLOWEST:
            return
        params = f.params.air_data
        innovation = observe_sideslip(self._air, self._jacobian, self._h)
        if math.isnan(innovation):
            return
        noise = params.sideslip_noise ** 2
        variance = project(f.cov.p, self._h, self._hp) + noise
        f.faults.sideslip = variance < noise
        if f.faults.sideslip:
            recover_covariance(f, self._wind)
            return
        f.rejections.sideslip = not passes(f, f.observations.sideslip, innovation, variance,
                                           params.sideslip_gate)
        if f.rejections.sideslip:
            return
        healthy = fuse_scalar(f, self._hp, variance, innovation,
                              wind_only=not f.wind_dead_reckoning)
        f.faults.sideslip = not healthy
        if healthy:
            f.times.sideslip = f.t_now
