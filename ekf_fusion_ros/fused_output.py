"""What a session gives out."""

from __future__ import annotations

from typing import NamedTuple

from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.samples import GnssSample


class FusedOutput(NamedTuple):
    """One due output: the state at `nav.time_us` and the fixes taken in since the last one.

    `local` is True where the frame is the odometry's own because no fix takes part.
    """

    nav: NavState
    local: bool
    fixes: tuple[GnssSample, ...] = ()

    @property
    def time_us(self) -> int:
        """Stamp of the state in integer microseconds."""
        return self.nav.time_us
