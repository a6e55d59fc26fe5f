"""Range finder: takes the sample behind the horizon and judges whether it can be believed."""

from __future__ import annotations

import math

from ekf_fusion_ros.buffer import SampleBuffer
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.state import FILTER_PERIOD_US
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.samples import RangeSample

STALE_US = 400_000
INTERVAL_SHARE = 0.005
"""Share of the newest age of the sample in its low-pass: 2 s at the filter rate."""

INTERVAL_MAX_US = 2e6
"""Mean age from which samples do not come regularly."""

INTERVAL_LIMIT_US = 4e6
STUCK_AFTER_US = 10 * SECOND
STUCK_SPREAD = 0.1
"""Spread in m that shows a sensor to be alive that has long been invalid."""

NEAREST_UNSET = 0.1


class RangeFinder:
    """`valid` lasts from sample to sample; `fresh` only in the step that took the sample."""

    def __init__(self, f: Filter, capacity: int) -> None:
        """Act on a filter."""
        self._f = f
        self.buffer: SampleBuffer[RangeSample] = SampleBuffer(capacity)
        self.distance = 0.0
        self.valid = False
        self.fresh = False
        self.regular = False
        self.time_us = 0
        self._cos_tilt = 1.0
        self._interval_us = 0.0
        self._bad_quality_us = 0
        self._last_valid_us = 0
        self._stuck = False
        self._nearest = self._farthest = 0.0
        self._cos_pitch = math.cos(f.params.range.pitch)
        self._sin_pitch = math.sin(f.params.range.pitch)
        self._good_quality_us = round(f.params.range.good_quality_time * SECOND)

    def push(self, sample: RangeSample, min_interval_us: int) -> None:
        """Queue a sample unless it follows the last one too closely."""
        if not self.buffer.admits(sample.time_us, min_interval_us):
            return
        delay_us = round(self._f.params.range.delay_ms * 1000) + FILTER_PERIOD_US // 2
        self.buffer.push(sample.time_us - delay_us, sample)

    def pop(self) -> None:
        """Take the sample at the horizon and judge it; once per filter period."""
        now = self._f.t_horizon
        if not self.buffer.last_arrival_us:
            if self._interval_us < INTERVAL_LIMIT_US:
                self._note_age(now)
            return
        self.fresh = False
        self._cos_tilt = self._tilt()
        popped = self.buffer.pop_first_older_than(now)
        if popped is not None:
            self.time_us = popped[0]
            self.distance = popped[1].distance
        age = now - self.time_us
        self._note_age(age)
        self.regular = age <= STALE_US and self._interval_us < INTERVAL_MAX_US
        if not self.regular:
            self.valid = False
        elif popped is not None:
            self.valid = self.fresh = self._judge(popped[1])
            if self.fresh:
                self._last_valid_us = self.time_us
                self._remove_lever_arm()

    @property
    def cos_tilt(self) -> float:
        """Cosine of the angle between the sensor axis and down, at the start of the step."""
        return self._cos_tilt if self.buffer.last_arrival_us else self._tilt()

    @property
    def height(self) -> float:
        """Height in m above flat ground that the distance tells."""
        return self.distance * self._cos_tilt

    def substitute(self, distance: float) -> None:
        """Take a distance in m that is known otherwise for a fresh and valid sample."""
        self.distance = distance
        self.valid = self.fresh = True

    def _note_age(self, age_us: int) -> None:
        mean = self._interval_us
        self._interval_us = min(mean + INTERVAL_SHARE * (age_us - mean), INTERVAL_LIMIT_US)

    def _tilt(self) -> float:
        rot = self._f.rot
        return float(rot[2, 0]) * self._sin_pitch + float(rot[2, 2]) * self._cos_pitch

    def _judge(self, sample: RangeSample) -> bool:
        now = self._f.t_horizon
        if sample.quality == 0:
            self._bad_quality_us = now
            return False
        settled = now - self._bad_quality_us > self._good_quality_us
        upright = self._cos_tilt > self._f.params.range.min_cos_tilt
        within = sample.min_distance <= sample.distance <= sample.max_distance
        if not (settled and upright and within):
            return False
        self._look_for_motion(sample.distance)
        return not self._stuck

    def _look_for_motion(self, distance: float) -> None:
        """After a long time without a valid sample the distance must vary to be believed."""
        if self.time_us - self._last_valid_us <= STUCK_AFTER_US:
            return
        if self._farthest - self._nearest > STUCK_SPREAD:
            self._nearest = self._farthest = 0.0
            self._stuck = False
            return
        self._farthest = max(self._farthest, distance)
        if self._nearest < NEAREST_UNSET or distance < self._nearest:
            self._nearest = distance
        self._stuck = True

    def _remove_lever_arm(self) -> None:
        """Move the distance from the sensor to the IMU."""
        lever = self._f.range_lever
        if lever is not None:
            self.distance += float(self._f.rot[2] @ lever) / self._cos_tilt
