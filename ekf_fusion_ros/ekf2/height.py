"""Height: the preferred sensor that is there is fused, or the last known height is held."""

from __future__ import annotations

import math

from ekf_fusion_ros.ekf2.aid_sources.barometer import Barometer
from ekf_fusion_ros.ekf2.aid_sources.gnss import VERTICAL_NOISE_RATIO
from ekf_fusion_ros.ekf2.aid_sources.gnss import Gnss
from ekf_fusion_ros.ekf2.aid_sources.vision import Vision
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.fusion import fuse_vertical_position
from ekf_fusion_ros.ekf2.gnss_checks import GnssChecks
from ekf_fusion_ros.ekf2.height_health import VISION_RECENT_US
from ekf_fusion_ros.ekf2.height_source import HeightSource
from ekf_fusion_ros.ekf2.range_height import RangeHeight
from ekf_fusion_ros.ekf2.state import PD
from ekf_fusion_ros.ekf2.state import SECOND

NO_HEIGHT_NOISE = 10.0
HOLD_INTERVAL_US = 200_000
HOLD_GATE = 300.0
"""Wide enough to pull back a height that has run away."""

KNOWN_CLIMB_VARIANCE = 0.25
"""Variance in (m/s)^2 of the climb rate below which height is dead reckoned, not held."""


class Height:
    """Starts the height source that the parameters prefer, and fuses its samples."""

    def __init__(self, f: Filter, source: HeightSource, baro: Barometer, gnss: Gnss,
                 checks: GnssChecks, vision: Vision, ranging: RangeHeight) -> None:
        """Act on a filter through the selected source; the sensors are asked for samples."""
        self._f = f
        self._source = source
        self._baro = baro
        self._gnss = gnss
        self._checks = checks
        self._vision = vision
        self._ranging = ranging
        self._last_known_down = 0.0

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
            self._ranging.fuse(self._source.offset)
        if self._f.flags.has_height():
            self._last_known_down = self._f.x.item(PD)
        else:
            self._hold()

    def _prefer_range(self) -> None:
        if self._ranging.finder.fresh:
            self._source.start_range(self._ranging.ground())
            self._ranging.fuse(self._source.offset)
        else:
            self._fall_back_to_baro()

    def _prefer_baro(self) -> None:
        f = self._f
        near_ground = self._ranging.aids()
        if near_ground and self._ranging.finder.fresh:
            self._source.start_range(self._ranging.terrain_down())
            self._ranging.fuse(self._source.offset)
        elif not near_ground and self._baro.popped and not self._baro.faulty:
            self._source.start_baro()
            self._baro.fuse()
        elif f.flags.gps_hgt and self._gnss.popped and not self._gnss.height_intermittent:
            self._source.tie_gnss()
            self._fuse_gnss()

    def _prefer_gnss(self) -> None:
        f = self._f
        may_start = (f.fix is not None and math.isfinite(f.fix.altitude)
                     and f.earth.has_origin and not self._gnss.height_intermittent
                     and self._checks.healthy_at_arrival)
        near_ground = self._ranging.aids()
        if near_ground and self._ranging.finder.fresh and not f.rng_hgt_before:
            self._source.start_range(self._ranging.terrain_down())
        elif f.rng_hgt_before and not near_ground:
            if may_start:
                self._source.start_gnss()
            elif not self._baro.faulty:
                self._source.start_baro()
        elif not f.flags.gps_hgt and not near_ground and may_start:
            self._source.start_gnss()
        if f.flags.gps_hgt and self._gnss.popped:
            self._fuse_gnss()
        elif f.flags.rng_hgt and self._ranging.finder.fresh:
            self._ranging.fuse(self._source.offset)
        else:
            self._fall_back_to_baro()

    def _prefer_vision(self) -> None:
        f = self._f
        if not f.flags.ev_hgt and f.recent(self._vision.buffer.last_arrival_us, VISION_RECENT_US):
            self._source.start_vision()
            if not f.rng_hgt_before:
                self._source.reset()
        if f.flags.ev_hgt and self._vision.popped:
            self._fuse_vision()
        elif f.flags.rng_hgt and self._ranging.finder.fresh:
            self._ranging.fuse(self._source.offset)
        else:
            self._fall_back_to_baro()

    def _fall_back_to_baro(self) -> None:
        """Fuse the barometer where it is the source, or where there is none."""
        if not self._baro.popped or self._baro.faulty:
            return
        if not self._f.flags.has_height() and self._baro.offset_known:
            self._source.start_baro()
        if self._f.flags.baro_hgt:
            self._baro.fuse()

    def _fuse_gnss(self) -> None:
        f = self._f
        fix, params = f.fix, f.params.gnss
        if fix is None or not math.isfinite(fix.altitude):
            return
        lower = VERTICAL_NOISE_RATIO * params.pos_noise
        upper = max(VERTICAL_NOISE_RATIO * f.params.aiding.pos_noaid_noise, lower)
        noise = min(max(fix.vacc, lower), upper) ** 2
        innovation = float(f.x[9]) + fix.altitude - f.earth.alt_ref - self._source.offset
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
            self._source.offset += shift
