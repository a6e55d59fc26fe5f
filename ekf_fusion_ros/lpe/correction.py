"""The Kalman correction, and the innovation that it and fault detection go by.

Kalman (1960), "A new approach to linear filtering and prediction problems"; the test of faults
is that of normalised innovation squared (Bar-Shalom et al., "Estimation with Applications to
Tracking and Navigation", 2001, section 5.4).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

THRESHOLDS = (0.0, 8.82050518214, 12.094592431, 13.9876612368, 16.0875642296, 17.8797700658,
              19.6465647819)
"""Of the normalised innovation squared by degrees of freedom, as in PX4.

About three in a thousand good measurements exceed them.
"""


class Measurement(NamedTuple):
    """A linear measurement y = C x + noise, of the state `x` where it was taken.

    y (n,), C (n, 10), R (n, n) or (n,) for a diagonal; x (10,), None for the present state.
    """

    y: Array
    C: Array
    R: Array
    x: Array | None = None


class Innovation(NamedTuple):
    """residual (n,) = y - C x, its covariance S (n, n), and beta = residual^T S^-1 residual."""

    residual: Array
    S: Array
    beta: float

    @property
    def ratio(self) -> float:
        """Beta over the threshold of its degrees of freedom."""
        return self.beta / THRESHOLDS[len(self.residual)]


def innovation_of(x: Array, P: Array, m: Measurement) -> Innovation:
    """Return the innovation of a measurement, by its own past state where it has one."""
    R = np.diag(m.R) if m.R.ndim == 1 else m.R
    residual = m.y - m.C @ (x if m.x is None else m.x)
    S = m.C @ P @ m.C.T + R
    return Innovation(residual, S, float(residual @ np.linalg.solve(S, residual)))


def corrected(P: Array, C: Array, innovation: Innovation) -> tuple[Array, Array]:
    """Return the change of x (10,) and the covariance (10, 10) after a correction."""
    PCt = P @ C.T
    K = np.linalg.solve(innovation.S, PCt.T).T
    after = P - K @ PCt.T
    return K @ innovation.residual, 0.5 * (after + after.T)
