"""Reading message fields: finite numbers, unit quaternions, covariances and what they mean."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.messages.refusal import Refused

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

QUATERNION_NORM_ERROR = 0.1


def vector(value: Any, name: str, limit: float, measured: Mask | None = None) -> Array:
    """Return x, y, z of a field as (3,), 0 for axes that are not measured, whatever they hold.

    Raises Refused 'not_finite', or 'out_of_range' when an element is beyond `limit`.
    """
    x, y, z = value.x, value.y, value.z
    if measured is not None and not measured.all():
        x, y, z = (e if known else 0.0 for e, known in zip((x, y, z), measured, strict=True))
    # One comparison catches NaN too.
    if not (-limit <= x <= limit and -limit <= y <= limit and -limit <= z <= limit):
        check_finite((x, y, z), name)
        raise Refused('out_of_range', f'{name} is ({x:g}, {y:g}, {z:g}): beyond {limit:g}')
    return np.array((x, y, z), dtype=np.float64)


def check_finite(values: Any, name: str) -> None:
    """Raise Refused 'not_finite' unless all values are finite."""
    if not all(map(math.isfinite, values)):
        numbers = ', '.join(f'{value:g}' for value in values)
        raise Refused('not_finite', f'{name} is ({numbers}): not finite')


def unit_quaternion(value: Any, name: str) -> Array:
    """Return an orientation field as (4,) w, x, y, z of unit length.

    Raises Refused 'not_finite', 'zero_quaternion', or 'bad_quaternion' when its length is more
    than 0.1 away from 1; smaller errors are normalised.
    """
    q = np.array((value.w, value.x, value.y, value.z), dtype=np.float64)
    norm = math.sqrt(float(q @ q))
    if abs(norm - 1.0) <= QUATERNION_NORM_ERROR:
        return q / norm
    check_finite(q.tolist(), name)
    if norm < 1e-6:
        raise Refused('zero_quaternion', f'{name} is all zero: not a rotation')
    raise Refused('bad_quaternion', f'{name} has length {norm:g} instead of 1')


def check_variances(covariance: Any, indices: tuple[int, ...], name: str) -> None:
    """Raise Refused 'nan_covariance' or 'negative_covariance' for bad diagonal elements."""
    for index in indices:
        variance = covariance[index]
        if not variance >= 0.0:
            reason = 'nan_covariance' if math.isnan(variance) else 'negative_covariance'
            raise Refused(reason, f'{name}[{index}] is {variance:g}: a variance must be 0 or more')


def matrix(covariance: Any, size: int, name: str) -> Array:
    """Return a row-major covariance field as (size, size).

    Raises Refused 'bad_covariance' when its length is wrong, 'nan_covariance' for any NaN and
    'negative_covariance' for a negative diagonal element.
    """
    full = np.asarray(covariance, dtype=np.float64)
    if full.size != size * size:
        raise Refused('bad_covariance', f'{name} has {full.size} elements, not {size * size}')
    full = full.reshape(size, size)
    if np.isnan(full).any():
        raise Refused('nan_covariance', f'{name} holds NaN')
    if (full.diagonal() < 0.0).any():
        raise Refused('negative_covariance', f'{name} has a negative variance')
    return full


def measured_block(
        block: Array, primary: tuple[bool, bool, bool], default: float, limit: float,
        name: str) -> tuple[Array, Mask]:
    """Return the covariance (3, 3) of the measured axes and which axes (3,) are measured.

    Variances from `limit` up, infinity too, mean not measured. Zero means unknown: such an axis
    gets the `default` variance, but where other axes of the block carry a variance only the
    `primary` axes do, since a planar odometry leaves zeros on the axes it does not measure. Rows
    and columns of axes that are not measured are zero. Raises Refused 'indefinite_covariance'
    when a correlation is beyond 1.
    """
    variance = block.diagonal()
    known = (variance > 0.0) & (variance < limit)
    unknown = variance == 0.0
    if known.any():
        unknown = unknown & primary
    cleaned = np.where(np.outer(known, known), 0.5 * block + 0.5 * block.T, 0.0)
    sigma = np.sqrt(np.where(known, variance, 0.0))
    if not (np.abs(cleaned) <= 1.0005 * np.outer(sigma, sigma)).all():
        raise Refused('indefinite_covariance', f'{name} has a correlation beyond 1')
    cleaned[unknown, unknown] = default
    return cleaned, known | unknown
