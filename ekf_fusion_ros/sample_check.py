"""Samples that were not decoded from messages, checked at the door."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

import numpy as np

from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.samples import AirspeedSample
from ekf_fusion_ros.samples import AuxVelocitySample
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import DriftSample
from ekf_fusion_ros.samples import FlowSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import HeadingSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import RangeSample
from ekf_fusion_ros.samples import Sample
from ekf_fusion_ros.samples import VisionSample

QUATERNION_NORM_ERROR = 0.1


def check_sample(sample: Sample) -> None:
    """Raise Refused for numbers that must never reach a filter.

    NaN is allowed where it means 'not measured': fix altitude, velocity and yaw; position,
    attitude and velocity of vision; the gyro of a flow sensor.
    """
    check = _CHECKS.get(type(sample))
    if check is not None:
        check(sample)


def _imu(sample: ImuSample) -> None:
    _finite('imu', sample.delta_angle, sample.delta_velocity)
    for interval in (sample.delta_angle_dt, sample.delta_velocity_dt):
        if not (math.isfinite(interval) and interval > 0.0):
            raise Refused('bad_interval', f'the interval of an imu sample is {interval:g} s')


def _gnss(sample: GnssSample) -> None:
    _finite('fix', sample.lat, sample.lon, sample.eph, sample.epv)
    _variances('fix', sample.eph, sample.epv)
    if abs(sample.lat) > 90.0:
        raise Refused('bad_latitude', f'latitude is {sample.lat:g} deg')
    _finite_or_absent('fix', sample.velocity)
    _finite_or_absent('fix', sample.yaw)
    if math.isinf(sample.alt):
        raise Refused('not_finite', 'the altitude of a fix is infinite')
    if sample.has_velocity:
        _finite('fix', sample.sacc)
        _variances('fix', sample.sacc)
    if math.isfinite(sample.yaw):
        _finite('fix', sample.yaw_offset)


def _vision(sample: VisionSample) -> None:
    for part in (sample.position[0:2], sample.quaternion, sample.velocity):
        _finite_or_absent('odometry', part)
    if sample.has_attitude:
        _finite('odometry', sample.angular_var)
        norm = float(np.linalg.norm(sample.quaternion))
        if abs(norm - 1.0) > QUATERNION_NORM_ERROR:
            reason = 'zero_quaternion' if norm < 1e-6 else 'bad_quaternion'
            raise Refused(reason, f'an odometry quaternion has length {norm:g}')
    if sample.has_position:
        _finite('odometry', sample.position_var)
        _variances('odometry', *sample.position_var)
    if sample.has_velocity:
        _finite('odometry', sample.velocity_cov)
        _variances('odometry', *sample.velocity_cov.diagonal())


def _range(sample: RangeSample) -> None:
    _finite('range', sample.distance, sample.min_distance, sample.max_distance)
    if sample.distance < 0.0:
        raise Refused('negative_range', f'a distance is {sample.distance:g} m')
    if not 0.0 <= sample.min_distance < sample.max_distance:
        raise Refused('bad_limits', f'a range finder measures from {sample.min_distance:g} to '
                      f'{sample.max_distance:g} m')


def _flow(sample: FlowSample) -> None:
    _finite('flow', sample.flow)
    if np.isinf(sample.gyro).any():
        raise Refused('not_finite', 'the gyro of a flow sample is infinite')
    if not (math.isfinite(sample.dt) and sample.dt > 0.0):
        raise Refused('bad_interval', f'the interval of a flow sample is {sample.dt:g} s')
    if not 0 <= sample.quality <= 255:
        raise Refused('bad_quality', f'the quality of a flow sample is {sample.quality}')


def _airspeed(sample: AirspeedSample) -> None:
    _finite('airspeed', sample.true_airspeed, sample.eas2tas)
    if sample.true_airspeed < 0.0 or sample.eas2tas <= 0.0:
        raise Refused('negative_airspeed', f'a true airspeed is {sample.true_airspeed:g} m/s, '
                      f'{sample.eas2tas:g} times the equivalent one')


def _aux_velocity(sample: AuxVelocitySample) -> None:
    _finite('aux_velocity', sample.velocity, sample.variance)
    _variances('aux_velocity', *sample.variance)


def _heading(sample: HeadingSample) -> None:
    _finite('heading', sample.yaw, sample.variance)
    _variances('heading', sample.variance)


def _drift(sample: DriftSample) -> None:
    if not sample.walk >= 0.0:
        raise Refused('negative_covariance', f'a random walk of {sample.walk:g} m/sqrt(m)')


def _finite(name: str, *values: Any) -> None:
    if not all(np.isfinite(value).all() for value in values):
        raise Refused('not_finite', f'a number of a sample of {name} is not finite')


def _finite_or_absent(name: str, values: Any) -> None:
    if not (np.isfinite(values).all() or np.isnan(values).all()):
        raise Refused('not_finite', f'a vector of a sample of {name} is not finite')


def _variances(name: str, *values: float) -> None:
    if min(values) < 0.0:
        raise Refused('negative_covariance', f'a variance of {name} is {min(values):g}')


_CHECKS: dict[type, Callable[[Any], None]] = {
    ImuSample: _imu,
    GnssSample: _gnss,
    VisionSample: _vision,
    MagSample: lambda sample: _finite('magnetic_field', sample.field),
    BaroSample: lambda sample: _finite('pressure', sample.altitude),
    RangeSample: _range,
    FlowSample: _flow,
    AirspeedSample: _airspeed,
    AuxVelocitySample: _aux_velocity,
    HeadingSample: _heading,
    DriftSample: _drift,
}
