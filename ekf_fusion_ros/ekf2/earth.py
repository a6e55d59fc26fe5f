"""Where the filter is on the earth: origin, projection, rotation rate and magnetic field."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.geo.magnetic_field import FieldPoint
from ekf_fusion_ros.geo.magnetic_field import MagneticField
from ekf_fusion_ros.geo.magnetic_field import make_field
from ekf_fusion_ros.geo.projection import Projection
from ekf_fusion_ros.geo.projection import make_projection

Array = NDArray[np.float64]
EARTH_RATE = 7.292115e-5
YEAR_US = 365.2425 * 86400e6
MIN_FIELD = 1e-3
"""Horizontal field in Gauss that is plausible anywhere."""


class EarthReference:
    """Origin of the local frame and what a latitude and longitude tell.

    `shortest_field` is the shortest horizontal field in Gauss that is plausible here.
    """

    def __init__(self, projection: str, field_model: str) -> None:
        """Know nothing yet; projection 'wgs84' or 'sphere', field model 'ecl_table' or 'wmm'."""
        self._projection_name = projection
        self._field_name = field_model
        self._field_model: MagneticField | None = None
        self.projection: Projection | None = None
        self.origin: GeoPoint | None = None
        self.origin_lat = math.nan
        self.origin_lon = math.nan
        self.alt_ref = 0.0
        self.rate_ned = np.zeros(3)
        self.field: FieldPoint | None = None
        self.shortest_field = MIN_FIELD

    @property
    def has_origin(self) -> bool:
        """True once the local frame is tied to the earth."""
        return self.projection is not None

    def set_origin(self, lat: float, lon: float, alt: float) -> None:
        """Tie position (0, 0, 0) to a point; deg, m."""
        self.projection = make_projection(self._projection_name, lat, lon, alt)
        self.origin = GeoPoint(lat, lon, alt)
        self.origin_lat, self.origin_lon, self.alt_ref = lat, lon, alt

    def set_origin_from(self, lat: float, lon: float, alt: float, position: Array) -> None:
        """Tie a point to the current position (3,) NED, so that the position stays valid."""
        shifted = make_projection(self._projection_name, lat, lon, alt)
        lat0, lon0 = shifted.reproject(-float(position[0]), -float(position[1]))
        self.set_origin(lat0, lon0, alt + float(position[2]))

    def look_around(self, lat: float, lon: float, time_us: int) -> None:
        """Take earth rate and magnetic field for a latitude and longitude in deg."""
        if self._field_model is None:
            self._field_model = make_field(self._field_name, 1970.0 + time_us / YEAR_US)
        phi = math.radians(lat)
        self.rate_ned = np.array((EARTH_RATE * math.cos(phi), 0.0, -EARTH_RATE * math.sin(phi)))
        field = self.field = self._field_model.lookup(lat, lon)
        self.shortest_field = max(MIN_FIELD, 0.5 * field.strength * math.cos(field.inclination))
