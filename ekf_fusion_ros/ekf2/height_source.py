"""Which sensor is the height reference, and what its height is told against."""

from __future__ import annotations

import math

from ekf_fusion_ros.ekf2.aid_sources.barometer import Barometer
from ekf_fusion_ros.ekf2.aid_sources.gnss import VERTICAL_NOISE_RATIO
from ekf_fusion_ros.ekf2.aid_sources.gnss import Gnss
from ekf_fusion_ros.ekf2.aid_sources.vision import Vision
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.range_height import RangeHeight
from ekf_fusion_ros.ekf2.resets import UNKNOWN_CLIMB_VARIANCE
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.observation import Observation

HEIGHT_WORDS = {'baro_hgt': 'barometric height', 'gps_hgt': 'GNSS height',
                'rng_hgt': 'range height', 'ev_hgt': 'odometry height'}
"""What is used where a flag is set, in words."""


class HeightSource:
    """Selects a sensor and resets height to it.

    `offset` in m is the height of the sensor's own zero: that of the ground for a range finder.
    """

    def __init__(self, f: Filter, resets: Resets, baro: Barometer, gnss: Gnss, vision: Vision,
                 ranging: RangeHeight) -> None:
        """Act on a filter through its resets; the sources are asked for their samples."""
        self._f = f
        self._resets = resets
        self._baro = baro
        self._gnss = gnss
        self._vision = vision
        self._ranging = ranging
        self.offset = 0.0

    def select(self, name: str) -> None:
        """Make 'baro', 'gnss', 'vision' or 'range' the reference."""
        flags = self._f.flags
        flags.baro_hgt = name == 'baro'
        flags.gps_hgt = name == 'gnss'
        flags.ev_hgt = name == 'vision'
        flags.rng_hgt = name == 'range'

    def start_baro(self) -> None:
        """Make barometric height the reference."""
        self.select('baro')
        self.offset = 0.0

    def start_gnss(self) -> None:
        """Make GNSS height the reference, without a step in height unless it is absolute."""
        self.select('gnss')
        self.tie_gnss()

    def tie_gnss(self) -> None:
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
        self.select('vision')
        self.offset = 0.0

    def start_range(self, ground: float) -> None:
        """Make range height the reference, over a ground at a down coordinate in m."""
        self.select('range')
        if not self._f.rng_hgt_before:
            self.offset = ground

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

    def in_words(self) -> str:
        """Return what the selected source is called."""
        flags = self._f.flags
        return next((words for name, words in HEIGHT_WORDS.items() if getattr(flags, name)),
                    'no height')

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
