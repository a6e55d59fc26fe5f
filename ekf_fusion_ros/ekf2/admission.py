"""Samples at the door of the filter: arrays of the right kind and shape, finite numbers."""

from __future__ import annotations

import math
from operator import attrgetter
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

Shape = tuple[int, ...]
THREE = (3,)
FLOAT = np.dtype(np.float64)
"""Of the byte order of this machine: another is not equal."""

THREE_FLOATS = (np.ndarray, FLOAT, (8,), 24)
_layout = attrgetter('__class__', 'dtype', 'strides', 'nbytes')
"""What tells a row of three numbers from all else, and how to look at it."""

MEASURED: dict[type[Any], dict[str, Shape]] = {
    ImuSample: {'delta_angle': THREE, 'delta_velocity': THREE},
    MagSample: {'field': THREE},
    FlowSample: {'flow': (2,)},
    AuxVelocitySample: {'velocity': THREE, 'variance': THREE},
}
"""Arrays that must be finite."""

PERHAPS_MEASURED: dict[type[Any], dict[str, Shape]] = {
    GnssSample: {'velocity': THREE},
    VisionSample: {'position': THREE, 'quaternion': (4,), 'velocity': THREE,
                   'position_var': THREE, 'velocity_cov': (3, 3)},
    FlowSample: {'gyro': THREE},
}
"""Arrays whose NaN means that nothing was measured."""

NUMBERS: dict[type[Any], tuple[str, ...]] = {
    ImuSample: ('delta_angle_dt', 'delta_velocity_dt'),
    GnssSample: ('lat', 'lon', 'eph'),
    BaroSample: ('altitude',),
    AirspeedSample: ('true_airspeed', 'eas2tas'),
    HeadingSample: ('yaw', 'variance'),
}

ACCURACIES: dict[type[Any], dict[str, str]] = {
    GnssSample: {'epv': 'alt', 'sacc': 'velocity', 'yaw_offset': 'yaw'},
    VisionSample: {'position_var': 'position', 'velocity_cov': 'velocity',
                   'angular_var': 'quaternion'},
}
"""What must be finite where that which it belongs to was measured: axis by axis where both have
the same axes."""

WHOLE: dict[type[Any], tuple[str, ...]] = {
    GnssSample: ('velocity',), VisionSample: ('quaternion', 'velocity'),
}
"""Arrays that are measured throughout or not at all; of a position the height may be missing."""


def _places(
    kind: type[Any], arrays: dict[type[Any], dict[str, Shape]],
) -> tuple[tuple[int, Shape], ...]:
    return tuple((kind._fields.index(name), shape)
                 for name, shape in arrays.get(kind, {}).items())


_CHECKS = {kind: (_places(kind, MEASURED), _places(kind, PERHAPS_MEASURED),
                  tuple(kind._fields.index(name) for name in NUMBERS.get(kind, ())),
                  tuple(kind._fields.index(name) for name in ACCURACIES.get(kind, ())),
                  tuple(kind._fields.index(name) for name in WHOLE.get(kind, ())))
           for kind in (*MEASURED, *PERHAPS_MEASURED, *NUMBERS)}
_NOTHING: tuple[Any, ...] = (), (), (), (), ()


def admitted_imu(sample: ImuSample) -> ImuSample:
    """Return what `admitted` does, at once where there is nothing to change.

    Whether its numbers are finite is left to the kernel that takes them (InertialInput.add).
    """
    try:
        if _layout(sample.delta_angle) == _layout(sample.delta_velocity) == THREE_FLOATS:
            return sample
    except AttributeError:
        pass
    changed: ImuSample = _changed(sample)
    return changed


def admitted(sample: Any) -> Any:
    """Return a sample whose arrays are contiguous and of float64, whatever holds their numbers.

    Raises ValueError, naming type and field, for a wrong shape and for numbers that are not
    finite where they must be.
    """
    must, may, numbers, accuracies, whole = _CHECKS.get(type(sample), _NOTHING)
    for place, shape in must:
        value = sample[place]
        # A sum is finite only where all of its terms are.
        if not (_is_plain(value, shape) and math.isfinite(sum(value.tolist()))):
            return _changed(sample)
    for place, shape in may:
        if not _is_plain(sample[place], shape):
            return _changed(sample)
    for place in numbers:
        if not math.isfinite(sample[place]):
            return _changed(sample)
    for place in accuracies:
        value = sample[place]
        if not math.isfinite(sum(value.ravel().tolist()) if type(value) is np.ndarray else value):
            # Perhaps it belongs to nothing that was measured.
            return _changed(sample)
    for place in whole:
        values = sample[place].tolist()
        if math.isfinite(values[0]) and not math.isfinite(sum(values)):
            return _changed(sample)
    return sample


def _is_plain(value: Any, shape: Shape) -> bool:
    return (type(value) is np.ndarray and value.shape == shape and value.dtype == FLOAT
            and value.flags.c_contiguous)


def _changed(sample: Any) -> Any:
    """Return a sample with arrays as the filter takes them, or raise ValueError."""
    kind = type(sample)
    must, may = MEASURED.get(kind, {}), PERHAPS_MEASURED.get(kind, {})
    changes = {name: _as_array(getattr(sample, name), shape, f'{kind.__name__}.{name}')
               for name, shape in {**must, **may}.items()}
    changed = sample._replace(**changes)
    if _wrong(changed):
        raise not_finite(changed)
    return changed


def not_finite(sample: Any) -> ValueError:
    """Return the error that names the fields of a sample that are not finite, but must be."""
    return ValueError(f'{", ".join(_wrong(sample))}: must be finite')


def _wrong(sample: Any) -> list[str]:
    """Return in words the fields that must be finite and are not."""
    kind = type(sample)
    return [f'{kind.__name__}.{name} is {getattr(sample, name)}'
            for name in (*MEASURED.get(kind, {}), *NUMBERS.get(kind, ()))
            if not np.isfinite(getattr(sample, name)).all()] + [
        f'{kind.__name__}.{name} is {getattr(sample, name)} beside a measured {of}'
        for name, of in ACCURACIES.get(kind, {}).items()
        if _is_missing(getattr(sample, name), getattr(sample, of))] + [
        f'{kind.__name__}.{name} is {getattr(sample, name)}, measured in part'
        for name in WHOLE.get(kind, ())
        if len(set(np.isfinite(getattr(sample, name)))) > 1]


def _is_missing(accuracy: Any, measured: Any) -> bool:
    """Return whether an accuracy is not finite where that which it belongs to is."""
    known, needed = np.isfinite(accuracy), np.isfinite(measured)
    if known.shape != needed.shape:
        return bool(needed.any() and not known.all())
    return bool((needed & ~known).any())


def _as_array(value: Any, shape: Shape, name: str) -> Any:
    try:
        array = np.ascontiguousarray(value, np.float64)
    except (TypeError, ValueError):
        raise ValueError(f'{name} is {value!r}: expected {shape} numbers') from None
    if array.shape != shape:
        raise ValueError(f'{name} has shape {array.shape}: expected {shape}')
    return array
