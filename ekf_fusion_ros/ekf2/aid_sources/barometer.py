"""Barometric height: averaged at arrival, fused while it is the reference, tracked while not."""

from __future__ import annotations

from ekf_fusion_ros.buffer import SampleBuffer
from ekf_fusion_ros.ekf2.averaging import SampleAverage
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.fusion import fuse_vertical_position
from ekf_fusion_ros.ekf2.state import PD
from ekf_fusion_ros.ekf2.static_pressure import has_pressure_error
from ekf_fusion_ros.ekf2.static_pressure import pressure_error_height
from ekf_fusion_ros.samples import BaroSample

FAULTY_AFTER_US = 400_000
OFFSET_GAIN = 0.1
OFFSET_RATE_MAX = 0.1
"""Fastest change of the offset in m/s while another sensor is the reference."""


class Barometer:
    """Pressure altitude against the offset found at start."""

    def __init__(self, f: Filter, capacity: int) -> None:
        """Act on a filter."""
        self._f = f
        self._average = SampleAverage(0.0)
        self._has_pressure_error = has_pressure_error(f.params.baro)
        self.buffer: SampleBuffer[float] = SampleBuffer(capacity)
        self.offset = 0.0
        self.count = 0
        self.altitude = 0.0
        self.popped = False
        self._delay_us = round(f.params.baro.delay_ms * 1000)
        self.faulty = False
        self._time_us = 0
        self._previous_us = 0

    def push(self, sample: BaroSample, min_interval_us: int) -> None:
        """Average a raw sample in, and queue the mean when the interval has passed."""
        mean = self._average.add(sample.time_us, sample.altitude, min_interval_us, self._delay_us)
        if mean is None:
            return
        stamp, value = mean
        if self._has_pressure_error:
            value = value + pressure_error_height(self._f)
        self.buffer.push(stamp, value)

    def pop(self) -> None:
        """Take the sample at the horizon, and judge whether samples keep coming."""
        popped = self.buffer.pop_first_older_than(self._f.t_horizon)
        self.popped = popped is not None
        if popped is not None:
            self._previous_us = self._time_us
            self._time_us, self.altitude = popped

    def check_arrival(self) -> None:
        """Judge whether samples keep coming; call before `pop`."""
        self.faulty = self.buffer.newest_time_us + FAULTY_AFTER_US <= self._f.t_now

    def learn_offset(self) -> None:
        """Blend the offset towards the newest popped altitude, before the filter runs."""
        if self.popped:
            blended = 0.9 * self.offset + 0.1 * self.altitude
            self.offset = blended if self.count else self.altitude
            self.count += 1

    @property
    def offset_known(self) -> bool:
        """True once a sample has tied pressure altitude to the height of the filter."""
        return self.count > 0

    @property
    def newest_altitude(self) -> float:
        """Altitude of the newest sample, whether or not the horizon has passed it."""
        return 0.0 if self.buffer.newest is None else self.buffer.newest

    def fuse(self) -> None:
        """Fuse the popped altitude."""
        f = self._f
        params = f.params.baro
        innovation = f.x.item(PD) + self.altitude - self.offset
        fuse_vertical_position(f, f.observations.baro_height, innovation,
                               max(params.noise, 0.01) ** 2, params.gate)

    def follow(self) -> None:
        """Let the offset follow slowly while another sensor is the reference."""
        if not self.offset_known:
            self.offset = self.altitude + self._f.x.item(PD)
            self.count = 1
            return
        elapsed = min(max(1e-6 * (self._time_us - self._previous_us), 0.0), 1.0)
        rate = OFFSET_GAIN * (self.altitude + self._f.x.item(PD) - self.offset)
        self.offset += elapsed * min(max(rate, -OFFSET_RATE_MAX), OFFSET_RATE_MAX)
