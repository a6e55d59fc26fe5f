"""Truncated Taylor series: exact time derivatives of analytic motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Blend from 0 to 1 with four continuous derivatives, and its integral; lowest power first.
_STEP = (0.0, 0.0, 0.0, 0.0, 0.0, 126.0, -420.0, 540.0, -315.0, 70.0)
_RAMP = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 21.0, -60.0, 67.5, -35.0, 7.0)


class Series:
    """Taylor coefficients in time at N instants.

    coefficients (order + 1, N): row k holds the k-th derivative over k!. Arithmetic keeps the
    lower order of two operands. Equations: Griewank and Walther, Evaluating Derivatives, ch. 13.
    """

    def __init__(self, coefficients: Array) -> None:
        self.c = coefficients

    @classmethod
    def time(cls, instants: Array, order: int) -> Series:
        """Return the series of time itself, instants (N,) in s."""
        c = np.zeros((order + 1, len(instants)))
        c[0] = instants
        c[1] = 1.0
        return cls(c)

    @property
    def value(self) -> Array:
        """Value at the instants, (N,)."""
        return self.c[0]

    def derivative(self) -> Series:
        """Return the time derivative, one order lower."""
        return Series(self.c[1:] * np.arange(1, len(self.c))[:, np.newaxis])

    def __add__(self, other: Series | float) -> Series:
        if isinstance(other, Series):
            n = min(len(self.c), len(other.c))
            return Series(self.c[:n] + other.c[:n])
        c = self.c.copy()
        c[0] += other
        return Series(c)

    __radd__ = __add__

    def __neg__(self) -> Series:
        return Series(-self.c)

    def __sub__(self, other: Series | float) -> Series:
        return self + (-other)

    def __rsub__(self, other: float) -> Series:
        return -self + other

    def __mul__(self, other: Series | float) -> Series:
        if not isinstance(other, Series):
            return Series(self.c * other)
        n = min(len(self.c), len(other.c))
        c = np.zeros((n, self.c.shape[1]))
        for k in range(n):
            for j in range(k + 1):
                c[k] += self.c[j] * other.c[k - j]
        return Series(c)

    __rmul__ = __mul__

    def __truediv__(self, other: Series | float) -> Series:
        if not isinstance(other, Series):
            return Series(self.c / other)
        n = min(len(self.c), len(other.c))
        c = np.zeros((n, self.c.shape[1]))
        for k in range(n):
            c[k] = self.c[k]
            for j in range(1, k + 1):
                c[k] -= other.c[j] * c[k - j]
            c[k] /= other.c[0]
        return Series(c)


def sin_cos(x: Series) -> tuple[Series, Series]:
    """Return sine and cosine."""
    s, c = np.zeros_like(x.c), np.zeros_like(x.c)
    s[0], c[0] = np.sin(x.c[0]), np.cos(x.c[0])
    for k in range(1, len(x.c)):
        for j in range(1, k + 1):
            s[k] += j * x.c[j] * c[k - j] / k
            c[k] -= j * x.c[j] * s[k - j] / k
    return Series(s), Series(c)


def sqrt(x: Series) -> Series:
    """Return the square root of a positive series."""
    y = np.zeros_like(x.c)
    y[0] = np.sqrt(x.c[0])
    for k in range(1, len(x.c)):
        y[k] = x.c[k]
        for j in range(1, k):
            y[k] -= y[j] * y[k - j]
        y[k] /= 2.0 * y[0]
    return Series(y)


def step(x: Series) -> Series:
    """Return a blend: 0 below 0, 1 above 1, four continuous derivatives."""
    return _between(x, _STEP, 0.0, 1.0 + 0.0 * x)


def ramp(x: Series) -> Series:
    """Return the integral of `step`: 0 below 0, x - 1/2 above 1, five continuous derivatives."""
    return _between(x, _RAMP, 0.0, x - 0.5)


def _between(x: Series, polynomial: Sequence[float], below: float, above: Series) -> Series:
    inside = 0.0 * x
    for coefficient in reversed(polynomial):
        inside = inside * x + coefficient
    low = 0.0 * x + below
    c = np.where(x.value <= 0.0, low.c, np.where(x.value >= 1.0, above.c, inside.c))
    return Series(c)


def dot(a: Sequence[Series], b: Sequence[Series]) -> Series:
    """Return the scalar product of two vectors of series."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Sequence[Series], b: Sequence[Series]) -> list[Series]:
    """Return the vector product of two vectors of series."""
    return [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]


def unit(a: Sequence[Series]) -> list[Series]:
    """Return a vector of series divided by its length."""
    length = sqrt(dot(a, a))
    return [component / length for component in a]
