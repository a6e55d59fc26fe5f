"""What waits between now and the fusion horizon: filter periods of inertial data."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class DelayedImu(NamedTuple):
    """One filter period of inertial data: delta angle (3), delta velocity (3), both intervals."""

    time_us: int
    increments: NDArray[np.float64]
    clipping: tuple[bool, bool, bool]
