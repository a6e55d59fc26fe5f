"""The one place that knows whether kernels are compiled."""

from __future__ import annotations

from collections.abc import Callable
import os
from typing import Any
from typing import TypeVar

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
