"""Which sensor is the height reference, whether it is healthy, and what happens when it fails."""

from __future__ import annotations

import math

from ekf_fusion_ros.ekf2.aid_sources.barometer import Barometer
from ekf_fusion_ros.ekf2.aid_sources.gnss import VERTICAL_NOISE_RATIO
from ekf_fusion_ros.ekf2.aid_sources.gnss import Gnss
from ekf_fusion_ros.ekf2.aid_sources.vision import Vision
from ekf_fusion_ros.ekf2.delayed_imu import NO_CLIPPING
from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.fusion import fuse_vertical_position
from ekf_fusion_ros.ekf2.gnss_checks import GnssChecks
from ekf_fusion_ros.ekf2.range_height import RangeHeight
from ekf_fusion_ros.ekf2.resets import UNKNOWN_CLIMB_VARIANCE
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.observation import Observation

TIMEOUT_US = 5 * SECOND
BAD_ACCEL_RESET_US = SECOND // 2
BAD_ACCEL_PROBATION_US = 10 * SECOND
RATIO_LIMIT = 3.0
CLIP_COUNT_MAX = 100
VISION_RECENT_US = 400_000
NO_HEIGHT_NOISE = 10.0
HOLD_INTERVAL_US = 200_000
HOLD_GATE = 300.0
"""Wide enough to pull back a height that has run away."""

KNOWN_CLIMB_VARIANCE = 0.25
"""Variance in (m/s)^2 of the climb rate below which height is dead reckoned, not held."""


class Height:
    """Selects the height source, resets to it after a time-out, and fuses it."""

    def __init__(self, f: Filter, resets: Resets, baro: Barometer, gnss: Gnss, checks: GnssChecks,
                 vision: Vision, ranging: RangeHeight) -> None:
        """Act on a filter through its resets; the sources are asked for their samples."""
        self._f = f
        self._resets = resets
        self._baro = baro
        self._gnss = gnss
        self._checks = checks
        self._vision = vision
        self._ranging = ranging
        self.offset = 0.0
        self._clips = 0
        self._time_bad_us = 0
        self._time_good_us = 0
        self._last_known_down = 0.0

    # ---- health ----

    def check_health(self) -> None:
        """Judge the vertical acceleration and reset a height that is not fused any more."""
        f = self._f
        self._judge_vertical_acceleration()
        lost = f.late(f.times.hgt, TIMEOUT_US) or f.late(self._time_good_us, BAD_ACCEL_RESET_US)
        if lost and f.flags.has_height():
            self._recover()

    def _judge_vertical_acceleration(self) -> None:
        """Bad: two independent vertical sensors, or one while clipping, see the filter falling."""
        f = self._f
        velocity, position = f.ver_vel_check, f.ver_pos_check
        suspicious = velocity.ratio > RATIO_LIMIT or position.ratio > RATIO_LIMIT
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
        if self._clips or f.imu.clipping != NO_CLIPPING:
            self._count_clips()
        bad = (independent or self._clips > 0) and falling
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

    def _recover(self) -> None:
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
            f.events.add(f.t_now, EventKind.HEIGHT_TIMEOUT)
            f.times.hgt = f.t_now
            self.reset()

    def _recover_from_baro(self) -> bool:
        newest = self._gnss.buffer.newest
        accel_is_good = self._f.late(self._time_bad_us, BAD_ACCEL_PROBATION_US)
        accurate = newest is not None and newest.vacc < self._f.params.gnss.checks.req_vacc
        prefer_gnss = (accurate and accel_is_good) or self._baro.faulty
        if not self._gnss.height_intermittent and prefer_gnss:
            self._baro.faulty = True
            self.start_gnss()
            return True
        return not self._baro.faulty

    def _recover_from_gnss(self) -> bool:
        f = self._f
        newest = self._gnss.buffer.newest
        accurate = newest is not None and newest.vacc < f.params.gnss.checks.req_vacc
        error = float(f.x[9]) - (self.offset - self._baro.newest_altitude + self._baro.offset)
        spread = (f.params.baro.noise ** 2 + f.cov.p[9, 9]) * max(f.params.baro.gate, 1.0) ** 2
        consistent = abs(error) < spread and not accurate
        if not self._baro.faulty and (consistent or self._gnss.height_intermittent):
            self.start_baro()
            return True
        return not self._gnss.height_intermittent

    def _recover_from_vision(self) -> bool:
        if self._f.recent(self._vision.buffer.newest_time_us, VISION_RECENT_US):
            return True
        if self._ranging.finder.valid:
            self._select('range')
            return True
        return self._recover_to_baro()

    def _recover_to_baro(self) -> bool:
        if self._baro.faulty:
            return False
        self.start_baro()
        return True

    # ---- starts ----

    def _select(self, name: str) -> None:
        flags = self._f.flags
        flags.baro_hgt = name == 'baro'
        flags.gps_hgt = name == 'gnss'
        flags.ev_hgt = name == 'vision'
        flags.rng_hgt = name == 'range'

    def start_baro(self) -> None:
        """Make barometric height the reference."""
        self._select('baro')
        self.offset = 0.0

    def start_gnss(self) -> None:
        """Make GNSS height the reference, without a step in height unless it is absolute."""
        self._select('gnss')
        self._tie_gnss()

    def _tie_gnss(self) -> None:
        """Take the present height to be that of the last fix where GNSS has just taken over."""
        f = self._f
        if f.params.height.gnss_absolute:
            self.offset = 0.0
        elif not f.gps_hgt_before:
            newest = self._gnss.buffer.newest
            fix = newest if f.fix is None or math.isnan(f.fix.altitude) else f.fix
            altitude = 0.0 if fix is None else fix.altitude
            self.offset = altitude - f.earth.alt_ref + float(f.x[9])

    def refer_to(self, rise: float) -> None:
        """Keep GNSS height in use where it is when the origin first sets the reference altitude.

        rise: change of the reference altitude in m, which the state does not follow.
        """
        if self._f.flags.gps_hgt and not self._f.params.height.gnss_absolute:
            self.offset -= rise

    def start_vision(self) -> None:
        """Make odometry height the reference."""
        self._select('vision')
        self.offset = 0.0

    def _start_range(self, ground: float) -> None:
        """Make range height the reference, over a ground at a down coordinate in m."""
        self._select('range')
        if not self._f.rng_hgt_before:
            self.offset = ground

    # ---- reset ----

    def reset(self) -> None:
        """Move height and climb rate to the selected source."""
        f = self._f
        newest = self._gnss.buffer.newest
        if f.flags.baro_hgt:
            if not self._baro.faulty:
                down = -self._baro.newest_altitude + self._baro.offset
                self._resets.vertical_position(down, f.params.baro.noise ** 2)
        elif f.flags.gps_hgt:
            if not self._gnss.height_intermittent and newest is not None:
                down = self.offset - newest.altitude + f.earth.alt_ref
                self._resets.vertical_position(down, newest.vacc ** 2)
                self._baro.offset = self._baro.newest_altitude + down
        elif f.flags.rng_hgt:
            self._reset_to_range()
        elif f.flags.ev_hgt:
            self._reset_to_vision()
        if (f.flags.gps and not self._gnss.height_intermittent and newest is not None
                and newest.has_velocity):
            variance = (VERTICAL_NOISE_RATIO * newest.sacc) ** 2
            self._resets.vertical_velocity(float(newest.velocity[2]), variance)
        else:
            self._resets.vertical_velocity(0.0, UNKNOWN_CLIMB_VARIANCE)

    def _reset_to_range(self) -> None:
        if not self._f.rng_hgt_before:
            self.offset = self._ranging.ground()
        down = self.offset - self._ranging.finder.height
        self._resets.vertical_position(down, self._f.params.range.noise ** 2)
        self._baro.offset = self._baro.newest_altitude + down

    def _reset_to_vision(self) -> None:
        f = self._f
        newest = self._vision.buffer.newest
        sample = f.vision
        if newest is not None and self._vision.buffer.newest_time_us >= self._vision.delayed_us:
            sample = newest
        if sample is not None and math.isfinite(sample.position[2]):
            self._resets.vertical_position(float(sample.position[2]), None)

    # ---- selection ----

    def step(self) -> None:
        """Select the source and fuse its sample; once per filter period."""
        reference = self._f.params.height.reference
        if reference == 'gnss':
            self._prefer_gnss()
        elif reference == 'vision':
            self._prefer_vision()
        elif reference == 'range':
            self._prefer_range()
        else:
            self._prefer_baro()
        if not self._f.flags.baro_hgt and self._baro.popped:
            self._baro.follow()
        if self._f.flags.rng_hgt and self._ranging.substitute_on_ground():
            self._ranging.fuse(self.offset)
        if self._f.flags.has_height():
            self._last_known_down = float(self._f.x[9])
        else:
            self._hold()

    def _prefer_range(self) -> None:
        if self._ranging.finder.fresh:
            self._start_range(self._ranging.ground())
            self._ranging.fuse(self.offset)
        else:
            self._fall_back_to_baro()

    def _prefer_baro(self) -> None:
        f = self._f
        near_ground = self._ranging.aids()
        if near_ground and self._ranging.finder.fresh:
            self._start_range(self._ranging.terrain_down())
            self._ranging.fuse(self.offset)
        elif not near_ground and self._baro.popped and not self._baro.faulty:
            self.start_baro()
            self._baro.fuse()
        elif f.flags.gps_hgt and self._gnss.popped and not self._gnss.height_intermittent:
            self._tie_gnss()
            self._fuse_gnss()

    def _prefer_gnss(self) -> None:
        f = self._f
        may_start = (f.fix is not None and math.isfinite(f.fix.altitude)
                     and f.earth.has_origin and not self._gnss.height_intermittent
                     and self._checks.healthy_at_arrival)
        near_ground = self._ranging.aids()
        if near_ground and self._ranging.finder.fresh and not f.rng_hgt_before:
            self._start_range(self._ranging.terrain_down())
        elif f.rng_hgt_before and not near_ground:
            if may_start:
                self.start_gnss()
            elif not self._baro.faulty:
                self.start_baro()
        elif not f.flags.gps_hgt and not near_ground and may_start:
            self.start_gnss()
        if f.flags.gps_hgt and self._gnss.popped:
            self._fuse_gnss()
        elif f.flags.rng_hgt and self._ranging.finder.fresh:
            self._ranging.fuse(self.offset)
        else:
            self._fall_back_to_baro()

    def _prefer_vision(self) -> None:
        f = self._f
        if not f.flags.ev_hgt and f.recent(self._vision.buffer.last_arrival_us, VISION_RECENT_US):
            self.start_vision()
            if not f.rng_hgt_before:
                self.reset()
        if f.flags.ev_hgt and self._vision.popped:
            self._fuse_vision()
        elif f.flags.rng_hgt and self._ranging.finder.fresh:
            self._ranging.fuse(self.offset)
        else:
            self._fall_back_to_baro()

    def _fall_back_to_baro(self) -> None:
        """Fuse the barometer where it is the source, or where there is none."""
        if not self._baro.popped or self._baro.faulty:
            return
        if not self._f.flags.has_height() and self._baro.offset_known:
            self.start_baro()
        if self._f.flags.baro_hgt:
            self._baro.fuse()

    # ---- fusion ----

    def _fuse_gnss(self) -> None:
        f = self._f
        fix, params = f.fix, f.params.gnss
        if fix is None or not math.isfinite(fix.altitude):
            return
        lower = VERTICAL_NOISE_RATIO * params.pos_noise
        upper = max(VERTICAL_NOISE_RATIO * f.params.aiding.pos_noaid_noise, lower)
        noise = min(max(fix.vacc, lower), upper) ** 2
        innovation = float(f.x[9]) + fix.altitude - f.earth.alt_ref - self.offset
        fuse_vertical_position(f, f.observations.gps_height, innovation, noise,
                               f.params.baro.gate)

    def _fuse_vision(self) -> None:
        f = self._f
        sample = f.vision
        if sample is None or not math.isfinite(sample.position[2]):
            return
        noise = max(float(sample.position_var[2]), 1e-4)
        fuse_vertical_position(f, f.observations.ev_height,
                               float(f.x[9] - sample.position[2]), noise,
                               f.params.vision.pos_gate)

    def _hold(self) -> None:
        """Hold the last known height without a source, unless a velocity tells how it changes."""
        f = self._f
        climb_known = (f.recent(f.times.ver_vel, SECOND)
                       and f.cov.p[6, 6] < KNOWN_CLIMB_VARIANCE)
        if climb_known:
            self._last_known_down = float(f.x[9])
        elif f.late(f.observations.fake_height.time_us, HOLD_INTERVAL_US):
            fuse_vertical_position(f, f.observations.fake_height,
                                   float(f.x[9]) - self._last_known_down, NO_HEIGHT_NOISE ** 2,
                                   HOLD_GATE)

    def move(self, shift: float) -> None:
        """Shift the held height and the ground down in m: the frame has moved, not the vehicle."""
        self._last_known_down += shift
        if self._f.flags.rng_hgt:
            self.offset += shift

    def active_record(self) -> Observation | None:
        """Return the record of the selected source."""
        seen, flags = self._f.observations, self._f.flags
        if flags.baro_hgt:
            return seen.baro_height
        if flags.gps_hgt:
            return seen.gps_height
        if flags.rng_hgt:
            return seen.range_height
        return seen.ev_height if flags.ev_hgt else None
