"""The home position as fields of ROS messages (ENU)."""

from __future__ import annotations

from dataclasses import dataclass
import math

from ekf_fusion_ros.frames import swap_yaw_enu_ned
from ekf_fusion_ros.health.home import Home


@dataclass(frozen=True, slots=True)
class HomeFields:
    """Home in the map frame: position x, y, z m ENU, yaw rad ENU; on the globe: deg, m.

    NaN where there is no map frame yet.
    """

    time_us: int
    position: tuple[float, float, float]
    yaw: float
    latitude: float
    longitude: float
    altitude: float

    @property
    def orientation(self) -> tuple[float, float, float, float]:
        """Orientation x, y, z, w: level, at the yaw."""
        half = 0.5 * (self.yaw if math.isfinite(self.yaw) else 0.0)
        return 0.0, 0.0, math.sin(half), math.cos(half)


def encode_home(home: Home) -> HomeFields:
    """Return home in ENU."""
    yaw = swap_yaw_enu_ned(home.yaw) if math.isfinite(home.yaw) else math.nan
    return HomeFields(
        home.time_us, (home.y, home.x, -home.z), yaw, home.lat, home.lon, home.alt)
