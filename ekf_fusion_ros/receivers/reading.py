"""What one receiver says, kind by kind, in the form in which receivers are compared."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.params.receivers import ReceiversParams
from ekf_fusion_ros.samples import GnssSample

Array = NDArray[np.float64]

KINDS = ('position', 'height', 'velocity')
PARTS = (slice(0, 2), slice(2, 3), slice(3, 6))
"""Where each kind stands in a deviation (6,)."""

UNITS = ('m', 'm', 'm/s')
SMALLEST_SIGMA = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """A fix, its deviation (6,) from the prediction and the accuracy it claims for each kind."""

    fix: GnssSample
    deviation: Array
    sigma: tuple[float, float, float]

    @classmethod
    def of(cls, fix: GnssSample, deviation: Array) -> Reading:
        """Return the reading of a fix; an accuracy of a kind that it lacks is infinite."""
        sacc = fix.sacc if fix.has_velocity and math.isfinite(fix.sacc) else math.inf
        eph, epv, sacc = (max(sigma, SMALLEST_SIGMA) for sigma in (fix.eph, fix.epv, sacc))
        return cls(fix, deviation, (eph, epv, sacc))

    def has(self, kind: int) -> bool:
        """True where this kind was measured."""
        return math.isfinite(self.sigma[kind])

    def shortcoming(self, kind: int, params: ReceiversParams) -> str:
        """Say why this kind is not worth using while another receiver is better, '' if it is."""
        if not self.has(kind):
            return 'not measured'
        if self.fix.fix_type < 3:
            return 'no 3-D fix'
        name = ('max_eph', 'max_epv', 'max_sacc')[kind]
        limit = getattr(params, name)
        if self.sigma[kind] > limit:
            return f'accuracy {self.sigma[kind]:.2g}, receivers.{name} {limit:g}'
        return ''
