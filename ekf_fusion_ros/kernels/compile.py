"""The one place that knows whether kernels are compiled."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Sequence
import os
from typing import Any
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Function = TypeVar('Function', bound=Callable[..., Any])


def _compiler() -> Callable[..., Any] | None:
    """Return numba's njit, or None where it is absent or switched off."""
    if os.environ.get('EKF_FUSION_NUMBA', '1') == '0':
        return None
    try:
        import numba
        import scipy.linalg  # noqa: F401  numba calls its BLAS for matrix products
    except ImportError:
        return None
    njit: Callable[..., Any] = numba.njit
    return njit


_njit = _compiler()

COMPILED = _njit is not None
"""True where kernels run as machine code."""


def kernel(function: Function) -> Function:
    """Compile a function of arrays and floats, or leave it as Python."""
    if _njit is None:
        return function
    compiled: Function = _njit(cache=True, error_model='numpy')(function)
    return compiled


def machine_code(function: Function) -> Function:
    """Return what a kernel has been compiled to, without numba's search for it at each call.

    That search is half the cost of a short call. Only for arrays whose type and layout their owner
    never changes: nothing checks them any more. The kernel itself until it has been compiled, and
    where it has been for more than one signature.
    """
    overloads = getattr(function, 'overloads', {})
    if len(overloads) != 1:
        return function
    (only,) = overloads.values()
    entry: Function = only.entry_point
    return entry


@kernel
def _read_three(v: Array) -> tuple[float, float, float]:
    return v[0], v[1], v[2]


@kernel
def _read_four(v: Array) -> tuple[float, float, float, float]:
    return v[0], v[1], v[2], v[3]


def _list_three(v: Array) -> Sequence[float]:
    floats: list[float] = v[:3].tolist()
    return floats


def _list_four(v: Array) -> Sequence[float]:
    floats: list[float] = v[:4].tolist()
    return floats


three: Callable[[Array], Sequence[float]] = _read_three if COMPILED else _list_three
"""The first three entries of an array. Plain Python computes with its own floats several times
faster than with those of numpy."""

four: Callable[[Array], Sequence[float]] = _read_four if COMPILED else _list_four
"""The first four entries of an array."""
