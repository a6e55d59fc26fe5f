"""Initial alignment: tilt from gravity, yaw from the field, height offset, first covariance."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.aid_sources.barometer import Barometer
from ekf_fusion_ros.ekf2.aid_sources.gnss import VERTICAL_NOISE_RATIO
from ekf_fusion_ros.ekf2.aid_sources.magnetometer import Magnetometer
from ekf_fusion_ros.ekf2.delayed_imu import DelayedImu
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.height_source import HeightSource
from ekf_fusion_ros.ekf2.state import FILTER_PERIOD
from ekf_fusion_ros.kernels.prediction import GRAVITY
from ekf_fusion_ros.mathlib.rotation import matrix_from_euler_321
from ekf_fusion_ros.mathlib.rotation import quat_from_matrix

Array = NDArray[np.float64]

SHARE = 0.1
"""Share of a new sample in the low-pass of acceleration and rate."""

DT_MIN = 1e-4
RATE_MAX = math.radians(15.0)
FORCE_MIN, FORCE_MAX = 0.8 * GRAVITY, 1.2 * GRAVITY
"""Specific force in m/s^2 and rate in rad/s between which gravity tells the tilt."""

WIND_VARIANCE = 1.0


class Alignment:
    """Gathers samples at the horizon until the filter can start."""

    def __init__(self, f: Filter, mag: Magnetometer, baro: Barometer, height: HeightSource,
                 samples_needed: int) -> None:
        """Act on a filter; samples_needed of each required sensor."""
        self._f = f
        self._mag = mag
        self._baro = baro
        self._height = height
        self._needed = samples_needed
        self._inertial_samples = 0
        self._accel = np.zeros(3)
        self._rate = np.zeros(3)

    def attempt(self, newest: DelayedImu) -> bool:
        """Use the newest filter period; True when tilt, yaw, height and P have been set."""
        increments = newest.increments
        if increments[6] < DT_MIN or increments[7] < DT_MIN:
            return False
        self._filter_inertial(increments[3:6] / increments[7], increments[0:3] / increments[6])
        self._mag.pop()
        self._baro.pop()
        self._baro.learn_offset()
        if self._lacking():
            return False
        if not self._tilt_from_gravity():
            return False
        if self._baro.count > 0:
            self._height.start_baro()
        if self._mag.usable:
            self._mag.reset_heading(initial=True)
        self._start_covariance()
        return True

    def _filter_inertial(self, accel: Array, rate: Array) -> None:
        if self._inertial_samples == 0:
            self._accel, self._rate = accel, rate
        else:
            self._accel = (1.0 - SHARE) * self._accel + SHARE * accel
            self._rate = (1.0 - SHARE) * self._rate + SHARE * rate
        self._inertial_samples += 1

    @property
    def obstacle(self) -> str:
        """What keeps the filter from starting, in words."""
        lacking = self._lacking()
        return f'not enough samples of {lacking} yet' if lacking else self._unlike_gravity()

    def _lacking(self) -> str:
        """Return the sensor of which there are not enough samples, '' where there are."""
        if self._mag.usable and self._mag.count < self._needed:
            return 'the magnetometer'
        height = self._f.params.height
        wait_for_baro = height.wait_for_baro or height.reference == 'baro' or self._baro.count > 0
        if wait_for_baro:
            return '' if self._baro.count >= self._needed else 'the barometer'
        return '' if self._inertial_samples >= self._needed else 'the IMU'

    def _unlike_gravity(self) -> str:
        """Return why the specific force does not tell the tilt, '' where it does."""
        norm = float(np.linalg.norm(self._accel))
        if not FORCE_MIN <= norm <= FORCE_MAX:
            return (f'the specific force is {norm:.1f} m/s^2, and must be within 20 % of gravity '
                    'for a tilt: units of the IMU, or a start in motion')
        rate = float(np.linalg.norm(self._rate))
        if rate > RATE_MAX:
            return (f'the body turns at {math.degrees(rate):.0f} deg/s, and must be slower than '
                    f'{math.degrees(RATE_MAX):.0f} for a tilt')
        return ''

    def _tilt_from_gravity(self) -> bool:
        f = self._f
        if self._unlike_gravity():
            return False
        norm = float(np.linalg.norm(self._accel))
        unit = self._accel / norm
        pitch = math.asin(float(unit[0]))
        roll = math.atan2(-float(unit[1]), -float(unit[2]))
        f.rot = matrix_from_euler_321(roll, pitch, 0.0)
        f.x[0:4] = quat_from_matrix(f.rot)
        return True

    def _start_covariance(self) -> None:
        initialise_covariance(self._f)
        if self._mag.usable:
            noise = max(self._f.params.mag.heading_noise, 1e-2) ** 2
            self._f.cov.add_yaw_variance(self._f.x[0:4], min(noise, 0.01))


def initialise_covariance(f: Filter) -> None:
    """Give every state its switch-on variance."""
    imu, gnss = f.params.imu, f.params.gnss
    cov = f.cov
    cov.set_variances(0, np.zeros(24))
    cov.set_attitude(f.x[0:4], np.full(3, imu.initial_tilt_err ** 2))
    velocity = max(gnss.vel_noise, 0.01) ** 2
    cov.set_variances(4, np.array((velocity, velocity, velocity * VERTICAL_NOISE_RATIO ** 2)))
    position = max(gnss.pos_noise, 0.01) ** 2
    if f.flags.gps_hgt:
        height = max(VERTICAL_NOISE_RATIO * gnss.pos_noise, 0.01) ** 2
    elif f.flags.rng_hgt:
        height = max(f.params.range.noise, 0.01) ** 2
    else:
        height = max(f.params.baro.noise, 0.01) ** 2
    cov.set_variances(7, np.array((position, position, height)))
    cov.set_variances(10, np.full(3, (imu.switch_on_gyro_bias * FILTER_PERIOD) ** 2))
    cov.set_variances(13, np.full(3, (imu.switch_on_accel_bias * FILTER_PERIOD) ** 2))
    cov.set_variances(16, np.full(6, f.params.mag.noise ** 2))
    cov.set_variances(22, np.full(2, WIND_VARIANCE))
