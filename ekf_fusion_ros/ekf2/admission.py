"""Samples at the door of the filter: arrays of the right kind and shape, finite numbers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ekf_fusion_ros.samples import AirspeedSample
from ekf_fusion_ros.samples import AuxVelocitySample
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import FlowSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import HeadingSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import VisionSample

THREE = (3,)
CONTIGUOUS = (8,)
FLOAT = np.dtype(np.float64)
"""The one object of native float64; another that equals it costs a copy, no more."""

# Field, shape, and whether NaN there means that nothing was measured.
ARRAYS: dict[type, tuple[tuple[str, tuple[int, ...], bool], ...]] = {
    ImuSample: (('delta_angle', THREE, False), ('delta_velocity', THREE, False)),
    MagSample: (('field', THREE, False),),
    GnssSample: (('velocity', THREE, True),),
    VisionSample: (
        ('position', THREE, True), ('quaternion', (4,), True), ('velocity', THREE, True),
        ('position_var', THREE, True), ('velocity_cov', (3, 3), True)),
    FlowSample: (('flow', (2,), False), ('gyro', THREE, True)),
    AuxVelocitySample: (('velocity', THREE, False), ('variance', THREE, False)),
}
NUMBERS: dict[type, tuple[str, ...]] = {
    ImuSample: ('delta_angle_dt', 'delta_velocity_dt'),
    GnssSample: ('lat', 'lon'),
    BaroSample: ('altitude',),
    AirspeedSample: ('true_airspeed', 'eas2tas'),
    HeadingSample: ('yaw', 'variance'),
}


def admitted_imu(sample: ImuSample) -> ImuSample:
    """Return what `admitted` does, at once where there is nothing to do."""
    _, angle, velocity, angle_dt, velocity_dt, _, _ = sample
    # Of every raw sample, so without a call: see _is_plain.
    plain = (type(angle) is type(velocity) is np.ndarray
             and angle.dtype is FLOAT and velocity.dtype is FLOAT
             and angle.shape == velocity.shape == THREE
             and angle.strides == velocity.strides == CONTIGUOUS)
    # A sum is finite only where all of its terms are.
    if plain and math.isfinite(
            sum(angle.tolist()) + sum(velocity.tolist()) + angle_dt + velocity_dt):
        return sample
    checked: ImuSample = admitted(sample)
    return checked


def admitted(sample: Any) -> Any:
    """Return a sample whose arrays are contiguous and of float64, whatever holds their numbers.

    Raises ValueError, naming type and field, for a wrong shape and for numbers that are not
    finite where they must be.
    """
    kind = type(sample)
    changes = {}
    for name, shape, may_lack in ARRAYS.get(kind, ()):
        value = getattr(sample, name)
        if not _is_plain(value, shape):
            value = changes[name] = _as_array(value, shape, f'{kind.__name__}.{name}')
        if not may_lack:
            _check_finite(value, f'{kind.__name__}.{name}')
    for name in NUMBERS.get(kind, ()):
        _check_finite(getattr(sample, name), f'{kind.__name__}.{name}')
    return sample._replace(**changes) if changes else sample


def _is_plain(value: Any, shape: tuple[int, ...]) -> bool:
    return (type(value) is np.ndarray and value.shape == shape and value.dtype is FLOAT
            and value.flags.c_contiguous)


def _as_array(value: Any, shape: tuple[int, ...], name: str) -> Any:
    try:
        array = np.ascontiguousarray(value, np.float64)
    except (TypeError, ValueError):
        raise ValueError(f'{name} is {value!r}: expected {shape} numbers') from None
    if array.shape != shape:
        raise ValueError(f'{name} has shape {array.shape}: expected {shape}')
    return array


def _check_finite(value: Any, name: str) -> None:
    if not np.isfinite(value).all():
        raise ValueError(f'{name} is {value}: must be finite')
