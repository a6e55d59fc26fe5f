"""Random sequences with stated statistics."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def white(rng: np.random.Generator, sigma: float, shape: tuple[int, ...]) -> Array:
    """Return independent normal values of standard deviation sigma."""
    return sigma * rng.standard_normal(shape)


def random_walk(rng: np.random.Generator, density: float, intervals: Array, width: int) -> Array:
    """Return a walk (N, width) from zero: variance density^2 times the elapsed time.

    intervals (N,) s is the time before each row; density is in units per sqrt(s).
    """
    steps = rng.standard_normal((len(intervals), width))
    steps *= density * np.sqrt(intervals)[:, np.newaxis]
    return np.cumsum(steps, axis=0)


def gauss_markov(
    rng: np.random.Generator, sigma: float, correlation_time: float, intervals: Array, width: int,
) -> Array:
    """Return a stationary first-order Gauss-Markov process (N, width).

    Standard deviation sigma, correlation exp(-dt / correlation_time); intervals as for
    `random_walk`. Gelb, Applied Optimal Estimation (1974), section 3.8.
    """
    unit = rng.standard_normal((len(intervals), width))
    process = np.empty_like(unit)
    state = unit[0]
    for k, dt in enumerate(intervals):
        if k > 0:
            keep = math.exp(-dt / correlation_time)
            state = keep * state + math.sqrt(1.0 - keep * keep) * unit[k]
        process[k] = state
    return sigma * process
