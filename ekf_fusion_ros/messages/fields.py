"""Reading message fields: finite numbers, unit quaternions, covariances and what they mean."""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.messages.refusal import Refused

Array = NDArray[np.float64]
Mask = tuple[bool, bool, bool]
Triple = Sequence[float]

QUATERNION_NORM_ERROR = 0.1
CORRELATION_MAX = 1.0005


def truth(value: object, name: str) -> bool:
    """Return a truth value; raises Refused 'not_boolean' for anything else."""
    if value not in (True, False):
        raise Refused('not_boolean', f'{name} is {value!r}: must be true or false')
    return bool(value)


def check_vector(vector: Triple, name: str, limit: float) -> None:
    """Raise Refused 'not_finite', or 'out_of_range' when an element is beyond `limit`."""
    x, y, z = vector
    # One comparison catches NaN too.
    if not (-limit <= x <= limit and -limit <= y <= limit and -limit <= z <= limit):
        check_finite(vector, name)
        raise Refused('out_of_range', f'{name} is ({x:g}, {y:g}, {z:g}): beyond {limit:g}')


def measured_vector(vector: Triple, measured: Mask, name: str, limit: float) -> Triple:
    """Return x, y, z of a field, 0 for axes that are not measured, whatever they hold.

    Raises Refused as `check_vector` does.
    """
    if not all(measured):
        x, y, z = (e if known else 0.0 for e, known in zip(vector, measured, strict=True))
        vector = x, y, z
    check_vector(vector, name, limit)
    return vector


def check_finite(values: Sequence[float], name: str) -> None:
    """Raise Refused 'not_finite' unless all values are finite."""
    if not all(map(math.isfinite, values)):
        numbers = ', '.join(f'{value:g}' for value in values)
        raise Refused('not_finite', f'{name} is ({numbers}): not finite')


def unit_quaternion(xyzw: Sequence[float], name: str) -> Array:
    """Return an orientation field, in the order of the message, as (4,) w, x, y, z of length 1.

    Raises Refused 'not_finite', 'zero_quaternion', or 'bad_quaternion' when its length is more
    than 0.1 away from 1; smaller errors are normalised.
    """
    x, y, z, w = xyzw
    elements = (w, x, y, z)
    norm = math.hypot(*elements)
    if abs(norm - 1.0) <= QUATERNION_NORM_ERROR:
        return np.array(elements, dtype=np.float64) / norm
    check_finite(elements, name)
    if norm < 1e-6:
        raise Refused('zero_quaternion', f'{name} is all zero: not a rotation')
    raise Refused('bad_quaternion', f'{name} has length {norm:g} instead of 1')


def check_variances(covariance: Sequence[float], indices: tuple[int, ...], name: str) -> None:
    """Raise Refused 'nan_covariance' or 'negative_covariance' for bad diagonal elements."""
    for index in indices:
        variance = covariance[index]
        if not variance >= 0.0:
            reason = 'nan_covariance' if math.isnan(variance) else 'negative_covariance'
            raise Refused(reason, f'{name}[{index}] is {variance:g}: a variance must be 0 or more')


def check_covariance(flat: Sequence[float], name: str) -> None:
    """Check the 36 numbers of a 6x6 row-major covariance.

    Raises Refused 'nan_covariance' for any NaN and 'negative_covariance' for a negative variance.
    """
    # The sum is NaN with any element, and far quicker than 36 tests.
    if math.isnan(sum(flat)) and any(map(math.isnan, flat)):
        raise Refused('nan_covariance', f'{name} holds NaN')
    if min(flat[::7]) < 0.0:
        raise Refused('negative_covariance', f'{name} has a negative variance')


def measured_block(
        flat: Sequence[float], first: int, primary: Mask, default: float, limit: float,
        name: str) -> tuple[Array, Mask]:
    """Return the covariance (3, 3) of the measured axes and which of the axes are measured.

    The block begins at row and column `first` of the 36 numbers. Variances from `limit` up,
    infinity too, mean not measured. Zero means unknown: such an axis gets the `default` variance,
    but where other axes of the block carry a variance only the `primary` axes do, since a planar
    odometry leaves zeros on the axes it does not measure. Rows and columns of axes that are not
    measured are zero. Raises Refused 'indefinite_covariance' when a correlation is beyond 1.
    """
    variance = flat[7 * first:7 * first + 15:7]
    known = [0.0 < v < limit for v in variance]
    some = any(known)
    block = np.zeros((3, 3))
    measured = list(known)
    for i in range(3):
        if known[i]:
            block[i, i] = variance[i]
        elif variance[i] == 0.0 and (primary[i] or not some):
            block[i, i] = default
            measured[i] = True
    for i, j in ((0, 1), (0, 2), (1, 2)):
        upper, lower = flat[6 * (first + i) + first + j], flat[6 * (first + j) + first + i]
        if known[i] and known[j] and (upper or lower):
            mean = 0.5 * upper + 0.5 * lower
            if not abs(mean) <= CORRELATION_MAX * math.sqrt(variance[i] * variance[j]):
                raise Refused('indefinite_covariance', f'{name} has a correlation beyond 1')
            block[i, j] = block[j, i] = mean
    return block, (measured[0], measured[1], measured[2])
