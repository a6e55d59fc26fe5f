"""Velocity against a target at rest, as of a landing beacon: fused beside other aiding."""

from __future__ import annotations

from ekf_fusion_ros.buffer import SampleBuffer
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.fusion import fuse_horizontal_velocity
from ekf_fusion_ros.ekf2.state import FILTER_PERIOD_US
from ekf_fusion_ros.ekf2.state import VE
from ekf_fusion_ros.ekf2.state import VN
from ekf_fusion_ros.samples import AuxVelocitySample

GATE = 5.0


class AuxiliaryVelocity:
    """Fuses whenever a sample comes and another source constrains horizontal motion."""

    def __init__(self, f: Filter, capacity: int) -> None:
        """Act on a filter."""
        self._f = f
        self.buffer: SampleBuffer[AuxVelocitySample] = SampleBuffer(capacity)

    def push(self, sample: AuxVelocitySample, min_interval_us: int) -> None:
        """Queue a sample unless it follows the last one too closely."""
        if not self.buffer.admits(sample.time_us, min_interval_us):
            return
        delay_us = round(self._f.params.aiding.auxvel_delay_ms * 1000) + FILTER_PERIOD_US // 2
        self.buffer.push(sample.time_us - delay_us, sample)

    def step(self) -> None:
        """Run once per filter period."""
        f = self._f
        if not self.buffer.last_arrival_us:
            return
        popped = self.buffer.pop_first_older_than(f.t_horizon)
        if popped is None or not f.flags.aided_horizontally():
            return
        sample, record = popped[1], f.observations.aux_vel
        north, east, _ = sample.velocity.tolist()
        f.last_velocity, f.last_velocity_variance = (north, east), tuple(record.variance)
        innovation = (f.x.item(VN) - north, f.x.item(VE) - east)
        fuse_horizontal_velocity(f, record, innovation, sample.variance[0:2].tolist(), GATE)
