"""GNSS position, and velocity where the fix has one."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.lpe.correction import Measurement
from ekf_fusion_ros.lpe.filter import Filter
from ekf_fusion_ros.lpe.sensors.sensor import TOO_LATE
from ekf_fusion_ros.lpe.sensors.sensor import Sensor
from ekf_fusion_ros.lpe.state import POSITION
from ekf_fusion_ros.lpe.state import SECOND
from ekf_fusion_ros.lpe.state import SIZE
from ekf_fusion_ros.mathlib.rotation import cross
from ekf_fusion_ros.samples import Antenna
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import travels

Array = NDArray[np.float64]
C = np.eye(6, SIZE)
LEAST_SATELLITES = 6
FIX_3D = 3


class Gnss(Sensor):
    """Fixes against the state at their time; the first good ones place the origin.

    Accuracy is asked for at the beginning only. The wide tolerance keeps a landing, whose
    vertical velocity hits the ground, from passing for a fault.
    """

    name: ClassVar[str] = 'gnss'
    size: ClassVar[int] = 6
    required: ClassVar[int] = 10
    timeout_us: ClassVar[int] = SECOND
    tolerance: ClassVar[float] = 100.0
    drops_faulty: ClassVar[bool] = False

    def __init__(self, f: Filter) -> None:
        super().__init__(f)
        self._places: list[tuple[float, float, float]] = []
        self._moved_us = -SECOND

    @property
    def moves(self) -> bool:
        """True while the fixes say by their velocity that the antenna travels."""
        return self._f.now_us - self._moved_us < self.timeout_us

    def enabled(self) -> bool:
        return self._f.params.gnss.enabled

    def measure(self, sample: GnssSample) -> GnssSample | None:
        if sample.fix_type >= FIX_3D:
            self._note_motion(sample)
            return sample
        self.passed_over['no_3d_fix'] += 1
        return None

    def _note_motion(self, fix: GnssSample) -> None:
        if not fix.has_velocity:
            return
        sacc = fix.sacc if math.isfinite(fix.sacc) else self._f.params.gnss.noise_vxy
        if travels(fix.velocity, sacc):
            self._moved_us = self._f.now_us

    def gather(self, measured: GnssSample) -> bool:
        params = self._f.params.gnss
        # What a fix does not tell is not asked for.
        enough = measured.nsats is None or measured.nsats >= LEAST_SATELLITES
        accurate = measured.eph <= params.eph_max and measured.epv <= params.epv_max
        self._places.append((measured.lat, measured.lon, measured.alt))
        return enough and accurate and math.isfinite(measured.alt)

    def begin(self) -> None:
        reference = self._f.map
        if reference.origin is None or reference.fake:
            self._place_origin()
        super().begin()

    def _place_origin(self) -> None:
        # About the first: the mean of longitudes must not cross the date line.
        lat, lon, alt = self._places[0]
        apart = np.array([(p[0] - lat, math.remainder(p[1] - lon, 360.0), p[2] - alt)
                          for p in self._places]).mean(axis=0)
        place = GeoPoint(lat + float(apart[0]), math.remainder(lon + float(apart[1]), 360.0),
                         alt + float(apart[2]))
        self._f.map.tie_at(place, self._f.x[POSITION])
        self._f.tell('fixes are good, origin set')

    def forget(self) -> None:
        super().forget()
        self._places = []

    def model(self, measured: GnssSample) -> Measurement | None:
        f = self._f
        taken_us = measured.time_us - round(SECOND * f.params.gnss.delay)
        then = f.history.at(taken_us, f.now_us, f.x)
        if then is None:
            self.passed_over[TOO_LATE] += 1
            return None
        place = f.map.position_of(GeoPoint(measured.lat, measured.lon, measured.alt))
        y = np.concatenate((place, measured.velocity)) - self._antenna(measured)
        known = np.isfinite(y)
        return Measurement(y[known], C[known], self._variances(measured)[known], then)

    def _antenna(self, fix: GnssSample) -> Array:
        """Return position and velocity (6,) NED of the antenna against the body origin."""
        attitude, arm = self._f.attitude, np.array(self._f.params.gnss.position)
        antenna = fix.antenna or Antenna(arm, arm, arm)
        position = attitude.rot @ antenna.position
        position[2] = attitude.rot[2] @ antenna.height
        velocity = attitude.rot @ cross(attitude.rate, antenna.velocity)
        return np.concatenate((position, velocity))

    def _variances(self, fix: GnssSample) -> Array:
        """Return what the fix states, but not less than the parameters, (6,)."""
        params = self._f.params.gnss
        sacc = fix.sacc if math.isfinite(fix.sacc) else 0.0
        xy, z = max(params.noise_xy, fix.eph), max(params.noise_z, fix.epv)
        vxy, vz = max(params.noise_vxy, sacc), max(params.noise_vz, sacc)
        return np.array((xy, xy, z, vxy, vxy, vz)) ** 2
