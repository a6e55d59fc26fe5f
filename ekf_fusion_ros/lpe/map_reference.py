"""The origin of the local frame on the earth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.geo.projection import make_projection

Array = NDArray[np.float64]


class MapReference:
    """Ties the local frame to the earth; `fake` while a parameter does, for want of a fix."""

    def __init__(self, projection: str) -> None:
        """projection: 'wgs84' or 'sphere'."""
        self._projection = projection
        self.origin: GeoPoint | None = None
        self.fake = False

    def tie(self, origin: GeoPoint, *, fake: bool = False) -> None:
        """Tie position (0, 0, 0) to a point."""
        self.origin, self.fake = origin, fake

    def tie_at(self, point: GeoPoint, position: Array) -> None:
        """Tie a position (3,) NED to a point, so that the position stays valid."""
        about = make_projection(self._projection, point.lat, point.lon, point.alt)
        lat, lon = about.reproject(-float(position[0]), -float(position[1]))
        self.tie(GeoPoint(lat, lon, point.alt + float(position[2])))

    def position_of(self, point: GeoPoint) -> Array:
        """Return the place (3,) NED m of a point; there must be an origin."""
        assert self.origin is not None
        origin = self.origin
        north, east = make_projection(
            self._projection, origin.lat, origin.lon, origin.alt).project(point.lat, point.lon)
        return np.array((north, east, origin.alt - point.alt))
