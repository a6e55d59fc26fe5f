"""True airspeed: tells the wind, and velocity too where nothing else does."""

from __future__ import annotations

import numpy as np

from ekf_fusion_ros.buffer import SampleBuffer
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.scalar import fuse_scalar
from ekf_fusion_ros.ekf2.scalar import passes
from ekf_fusion_ros.ekf2.state import FILTER_PERIOD_US
from ekf_fusion_ros.ekf2.wind import Wind
from ekf_fusion_ros.ekf2.wind import airspeed_variance
from ekf_fusion_ros.ekf2.wind import recover_covariance
from ekf_fusion_ros.kernels.air_data import observe_airspeed
from ekf_fusion_ros.kernels.innovation import project
from ekf_fusion_ros.samples import AirspeedSample

SLOWEST = 1.0
"""Predicted airspeed in m/s below which its gradient says too little."""


class Airspeed:
    """Starts the wind states in flight, fuses, and ends with its samples (see Wind)."""

    def __init__(self, f: Filter, wind: Wind, capacity: int) -> None:
        """Act on a filter and its wind states."""
        self._f = f
        self._wind = wind
        self.buffer: SampleBuffer[AirspeedSample] = SampleBuffer(capacity)
        self._h, self._hp = np.zeros(24), np.zeros(24)

    def push(self, sample: AirspeedSample, min_interval_us: int) -> None:
        """Queue a sample unless it follows the last one too closely."""
        if not self.buffer.admits(sample.time_us, min_interval_us):
            return
        delay_us = round(self._f.params.aiding.airspeed_delay_ms * 1000) + FILTER_PERIOD_US // 2
        self.buffer.push(sample.time_us - delay_us, sample)

    def pop(self) -> None:
        """Take the sample at the horizon."""
        f = self._f
        f.airspeed_popped = False
        if not self.buffer.last_arrival_us:
            return
        popped = self.buffer.pop_first_older_than(f.t_horizon)
        f.airspeed_popped = popped is not None
        if popped is not None:
            f.airspeed_us, f.airspeed = popped

    def step(self) -> None:
        """Run once per filter period."""
        f = self._f
        if not f.airspeed_popped or f.holding_position or not f.flags.in_air:
            return
        if self._wind.start():
            f.times.airspeed = f.t_now
        self._fuse()

    def _fuse(self) -> None:
        f = self._f
        sample = f.airspeed
        assert sample is not None
        predicted = observe_airspeed(f.x, self._h)
        if predicted < SLOWEST:
            return
        noise = airspeed_variance(f, sample.eas2tas)
        variance = project(f.cov.p, self._h, self._hp) + noise
        f.faults.airspeed = variance < noise
        if f.faults.airspeed:
            recover_covariance(f, self._wind)
            return
        innovation = predicted - sample.true_airspeed
        f.rejections.airspeed = not passes(f, f.observations.airspeed, innovation, variance,
                                           f.params.air_data.airspeed_gate)
        if f.rejections.airspeed:
            return
        healthy = fuse_scalar(f, self._hp, variance, innovation,
                              wind_only=not f.wind_dead_reckoning)
        f.faults.airspeed = not healthy
        if healthy:
            f.times.airspeed = f.t_now
            f.flags.fuse_aspd = True
