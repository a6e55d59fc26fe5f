"""Whether the height can be trusted, and where it is taken from once it cannot."""

from __future__ import annotations

from ekf_fusion_ros.ekf2.aid_sources.barometer import Barometer
from ekf_fusion_ros.ekf2.aid_sources.gnss import Gnss
from ekf_fusion_ros.ekf2.aid_sources.vision import Vision
from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.height_source import HeightSource
from ekf_fusion_ros.ekf2.range_height import RangeHeight
from ekf_fusion_ros.ekf2.state import PD
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.samples import NO_CLIPPING

TIMEOUT_US = 5 * SECOND
BAD_ACCEL_RESET_US = SECOND // 2
BAD_ACCEL_PROBATION_US = 10 * SECOND
RATIO_LIMIT = 3.0
CLIP_COUNT_MAX = 100
VISION_RECENT_US = 400_000


class HeightHealth:
    """Judges the vertical acceleration, and resets a height that nothing was fused into."""

    def __init__(self, f: Filter, source: HeightSource, baro: Barometer, gnss: Gnss,
                 vision: Vision, ranging: RangeHeight) -> None:
        """Act on a filter through the selected source; the others are asked whether they live."""
        self._f = f
        self._source = source
        self._baro = baro
        self._gnss = gnss
        self._vision = vision
        self._ranging = ranging
        self._clips = 0
        self._time_bad_us = 0
        self._time_good_us = 0

    def step(self) -> None:
        """Judge the vertical acceleration and reset a height that is not fused any more."""
        f = self._f
        self._judge_vertical_acceleration()
        if not f.flags.has_height():
            return
        if f.late(f.times.hgt, TIMEOUT_US):
            self._recover('height source timed out')
        elif f.late(self._time_good_us, BAD_ACCEL_RESET_US):
            self._recover('the accelerometer contradicts the height')

    def _judge_vertical_acceleration(self) -> None:
        """Bad: two independent vertical sensors, or one while clipping, see the filter falling."""
        f = self._f
        velocity, position = f.ver_vel_check, f.ver_pos_check
        suspicious = velocity.ratio > RATIO_LIMIT or position.ratio > RATIO_LIMIT
        clips = self._clips or f.imu.clipping != NO_CLIPPING
        if not (suspicious or clips or f.faults.accel_vertical):
            self._time_good_us = f.t_now
            return
        falling = independent = False
        if suspicious and f.recent(position.time_us, SECOND):
            if f.recent(velocity.time_us, SECOND):
                flags = f.flags
                same_sensor = ((flags.gps_hgt and flags.gps)
                               or (flags.ev_hgt and flags.ev_vel))
                independent = not same_sensor
                falling = ((velocity.ratio > RATIO_LIMIT and position.ratio > 0.0)
                           or (position.ratio > RATIO_LIMIT and velocity.ratio > 0.0))
            else:
                falling = position.ratio > RATIO_LIMIT
        if clips:
            self._count_clips()
        bad = falling and (independent or self._clips > 0)
        if bad:
            self._time_bad_us = f.t_now
        else:
            self._time_good_us = f.t_now
        if f.faults.accel_vertical:
            f.faults.accel_vertical = f.recent(self._time_bad_us, BAD_ACCEL_PROBATION_US)
        else:
            f.faults.accel_vertical = bad

    def _count_clips(self) -> None:
        clipped = any(self._f.imu.clipping)
        if clipped and self._clips < CLIP_COUNT_MAX:
            self._clips += 1
        elif self._clips > 0:
            self._clips -= 1

    def _recover(self, reason: str) -> None:
        """Switch to a source that is there, or reset to the present one."""
        f = self._f
        if f.flags.baro_hgt:
            recovered = self._recover_from_baro()
        elif f.flags.gps_hgt:
            recovered = self._recover_from_gnss()
        elif f.flags.ev_hgt:
            recovered = self._recover_from_vision()
        elif self._ranging.finder.valid:
            recovered = True
        else:
            recovered = self._recover_to_baro()
        if recovered:
            f.times.hgt = f.t_now
            before = f.x.item(PD)
            self._source.reset()
            self._tell(reason, before - f.x.item(PD))

    def _tell(self, reason: str, rise: float) -> None:
        """Announce a reset that has lifted the height by `rise` m."""
        f = self._f
        f.events.add(f.t_now, EventKind.HEIGHT_RESET, f'{reason}; now {self._source.in_words()}, '
                     f'{abs(rise):.1f} m {"higher" if rise >= 0.0 else "lower"}')

    def _recover_from_baro(self) -> bool:
        newest = self._gnss.buffer.newest
        accel_is_good = self._f.late(self._time_bad_us, BAD_ACCEL_PROBATION_US)
        accurate = newest is not None and newest.vacc < self._f.params.gnss.checks.req_vacc
        prefer_gnss = (accurate and accel_is_good) or self._baro.faulty
        if not self._gnss.height_intermittent and prefer_gnss:
            self._baro.faulty = True
            self._source.start_gnss()
            return True
        return not self._baro.faulty

    def _recover_from_gnss(self) -> bool:
        f = self._f
        newest = self._gnss.buffer.newest
        accurate = newest is not None and newest.vacc < f.params.gnss.checks.req_vacc
        down = self._source.offset - self._baro.newest_altitude + self._baro.offset
        spread = (f.params.baro.noise ** 2 + f.cov.p[9, 9]) * max(f.params.baro.gate, 1.0) ** 2
        consistent = abs(f.x.item(PD) - down) < spread and not accurate
        if not self._baro.faulty and (consistent or self._gnss.height_intermittent):
            self._source.start_baro()
            return True
        return not self._gnss.height_intermittent

    def _recover_from_vision(self) -> bool:
        if self._f.recent(self._vision.buffer.newest_time_us, VISION_RECENT_US):
            return True
        if self._ranging.finder.valid:
            self._source.select('range')
            return True
        return self._recover_to_baro()

    def _recover_to_baro(self) -> bool:
        if self._baro.faulty:
            return False
        self._source.start_baro()
        return True
