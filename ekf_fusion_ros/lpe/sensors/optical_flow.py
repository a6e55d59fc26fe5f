"""Velocity across the line of sight of a camera that looks down."""

from __future__ import annotations

import math
from typing import ClassVar
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.lpe.correction import Measurement
from ekf_fusion_ros.lpe.filter import Filter
from ekf_fusion_ros.lpe.sensors.sensor import Sensor
from ekf_fusion_ros.lpe.state import SECOND
from ekf_fusion_ros.lpe.state import SIZE
from ekf_fusion_ros.lpe.state import VELOCITY
from ekf_fusion_ros.mathlib.rotation import euler_321
from ekf_fusion_ros.samples import FlowSample

Array = NDArray[np.float64]

TILT_MAX = 0.5
HEIGHT_MIN = 0.3
INTERVAL_MAX = 0.5


class Seen(NamedTuple):
    """Velocity (2,) m/s forward and right, variance (m/s)^2 of either."""

    velocity: Array
    variance: float


class OpticalFlow(Sensor):
    """Velocity along the body's forward and right axes: flow rate times distance.

    The camera moves over the scene at minus the velocity, so that without rotation flow x is
    v_right dt / d and flow y is -v_forward dt / d, at the slant distance d = agl / cos(tilt). PX4
    multiplies by that cosine, takes the velocity along body down for zero and tests tilt to one
    side only.
    """

    name: ClassVar[str] = 'optical_flow'
    size: ClassVar[int] = 2
    required: ClassVar[int] = 10
    timeout_us: ClassVar[int] = SECOND

    def __init__(self, f: Filter) -> None:
        super().__init__(f)
        self._rotation_bias = np.zeros(2)

    def enabled(self) -> bool:
        return self._f.params.flow.enabled

    def measure(self, sample: FlowSample) -> Seen | None:
        f, params = self._f, self._f.params.flow
        rot = f.attitude.rot
        roll, pitch, _ = euler_321(rot)
        rotation = self._rotation(sample)
        reason = self._unusable(sample, roll, pitch)
        if reason:
            self.passed_over[reason] += 1
            return None
        distance = f.agl / float(rot[2, 2])
        x, y = (params.scale * sample.flow + rotation) * (distance / sample.dt)
        velocity = np.array((-y, x))
        self._tell_attitude(sample.time_us - round(0.5 * SECOND * sample.dt), velocity)
        return Seen(velocity, self._variance(velocity, roll, pitch))

    def model(self, measured: Seen) -> Measurement:
        C = np.zeros((2, SIZE))
        C[:, VELOCITY] = self._f.attitude.rot.T[:2]
        return Measurement(measured.velocity, C, np.full(2, measured.variance))

    def _tell_attitude(self, time_us: int, across: Array) -> None:
        """Tell the velocity that was seen (2,), along the line of sight that of the estimate."""
        f = self._f
        velocity = f.attitude.rot.T @ f.x[VELOCITY]
        velocity[:2] = across
        f.attitude.push_flow(time_us, f.attitude.rot @ velocity)

    def _unusable(self, sample: FlowSample, roll: float, pitch: float) -> str:
        f = self._f
        if max(abs(roll), abs(pitch)) > TILT_MAX:
            return 'tilted'
        if sample.quality < f.params.flow.min_quality:
            return 'bad_quality'
        if not f.valid.terrain or f.agl < HEIGHT_MIN:
            return 'no_height_above_ground'
        return '' if 1e-6 <= sample.dt <= INTERVAL_MAX else 'bad_interval'

    def _rotation(self, sample: FlowSample) -> Array:
        """Return the rotation (2,) of the body about x and y in rad, its steady part taken off."""
        params = self._f.params.flow
        if not params.gyro_compensation:
            return np.zeros(2)
        own = self._f.attitude.rate[:2] * sample.dt
        angle = -sample.gyro[:2] if np.isfinite(sample.gyro[:2]).all() else own
        # A low pass at so low a frequency is the bias of the gyro.
        weight = 2.0 * math.pi * params.gyro_highpass * sample.dt
        rate = angle / sample.dt
        self._rotation_bias += weight / (1.0 + weight) * (rate - self._rotation_bias)
        return np.asarray(angle - self._rotation_bias * sample.dt)

    def _variance(self, velocity: Array, roll: float, pitch: float) -> float:
        """Return the variance of PX4's fit to flights, grown by tilt and rates."""
        f, params = self._f, self._f.params.flow
        h = min(max(f.agl, 2.0), 8.0)
        v = min(max(float(np.linalg.norm(velocity)), 0.5), 1.0)
        sigma = (0.04005232 * h - 0.00656446 * h * h - 0.26265873 * v + 0.13686658 * v * h
                 - 0.00397357 * v * h * h)
        rate = f.attitude.rate
        return float(sigma ** 2 + params.noise_tilt ** 2 * (roll ** 2 + pitch ** 2)
                     + params.noise_rate ** 2 * (rate @ rate))
