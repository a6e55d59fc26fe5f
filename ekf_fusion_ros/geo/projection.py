"""Latitude and longitude to a local plane and back: on the WGS84 ellipsoid or on a sphere."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
import math
from typing import Protocol

SPHERE_RADIUS = 6371000.0
WGS84_A = 6378137.0
WGS84_F = 1.0 / 298.257223563
WGS84_B = WGS84_A * (1.0 - WGS84_F)
WGS84_E2 = WGS84_F * (2.0 - WGS84_F)

PROJECTIONS = ('wgs84', 'sphere')


class Projection(Protocol):
    """A map between latitude, longitude (deg) and north, east (m) about an origin."""

    def project(self, lat: float, lon: float) -> tuple[float, float]:
        """Return (north, east) in m."""

    def reproject(self, north: float, east: float) -> tuple[float, float]:
        """Return (latitude, longitude) in deg, longitude in [-180, 180)."""


@lru_cache(maxsize=8)
def make_projection(name: str, lat: float, lon: float, alt: float = 0.0) -> Projection:
    """Return the projection called `name` ('wgs84' or 'sphere') about an origin (deg, m).

    The projections of the last origins are kept: asking again is cheap. `alt` counts on the
    ellipsoid only. Raises ValueError on an unknown name or a bad origin.
    """
    if name == 'wgs84':
        return Wgs84Projection(lat, lon, alt)
    if name == 'sphere':
        return SphereProjection(lat, lon)
    raise ValueError(f'projection {name!r}: choose one of {", ".join(PROJECTIONS)}')


def wrap_degrees(angle: float) -> float:
    """Return the angle in [-180, 180)."""
    return math.fmod(math.fmod(angle + 180.0, 360.0) + 360.0, 360.0) - 180.0


class SphereProjection:
    """Azimuthal equidistant projection on a sphere of 6371 km, the one PX4 uses.

    Snyder, "Map Projections: A Working Manual" (1987), equations 25-1 to 25-4 and 20-14, 20-15.
    Distances differ from those on the ellipsoid by up to 0.5 %.
    """

    def __init__(self, lat: float, lon: float) -> None:
        """Set the origin (deg); ValueError where it is not on the earth."""
        _check_point(lat, lon)
        self._lon = math.radians(lon)
        self._sin_lat = math.sin(math.radians(lat))
        self._cos_lat = math.cos(math.radians(lat))

    def project(self, lat: float, lon: float) -> tuple[float, float]:
        """Return (north, east) in m."""
        phi = math.radians(lat)
        dlon = math.radians(lon) - self._lon
        sin_phi = math.sin(phi)
        cos_phi = math.cos(phi)
        cos_dlon = math.cos(dlon)
        cos_c = self._sin_lat * sin_phi + self._cos_lat * cos_phi * cos_dlon
        c = math.acos(max(-1.0, min(1.0, cos_c)))
        sin_c = math.sin(c)
        scale = SPHERE_RADIUS * (c / sin_c if sin_c > 0.0 else 1.0)
        north = self._cos_lat * sin_phi - self._sin_lat * cos_phi * cos_dlon
        return scale * north, scale * cos_phi * math.sin(dlon)

    def reproject(self, north: float, east: float) -> tuple[float, float]:
        """Return (latitude, longitude) in deg, longitude in [-180, 180)."""
        c = math.hypot(north, east) / SPHERE_RADIUS
        sinc = math.sin(c) / c if c > 0.0 else 1.0
        x = north / SPHERE_RADIUS * sinc
        y = east / SPHERE_RADIUS * sinc
        cos_c = math.cos(c)
        sin_phi = cos_c * self._sin_lat + x * self._cos_lat
        toward_axis = cos_c * self._cos_lat - x * self._sin_lat
        lat = math.atan2(sin_phi, math.hypot(toward_axis, y))
        lon = self._lon + math.atan2(y, toward_axis)
        return math.degrees(lat), wrap_degrees(math.degrees(lon))


class LocalTangent:
    """East, north, up about a point of the WGS84 ellipsoid, exact."""

    def __init__(self, lat: float, lon: float, alt: float = 0.0) -> None:
        """Set the origin (deg, m above the ellipsoid); ValueError where it is not usable."""
        _check_point(lat, lon)
        if not math.isfinite(alt):
            raise ValueError(f'origin altitude {alt}: must be finite')
        self._axes = _Axes.at(lat, lon)
        self._origin = _ecef(lat, lon, alt)

    def to_enu(self, lat: float, lon: float, alt: float) -> tuple[float, float, float]:
        """Return (east, north, up) in m of a geodetic point (deg, m)."""
        x, y, z = _ecef(lat, lon, alt)
        x0, y0, z0 = self._origin
        return self._axes.to_enu(x - x0, y - y0, z - z0)

    def to_geodetic(self, east: float, north: float, up: float) -> tuple[float, float, float]:
        """Return (latitude, longitude, altitude) in deg and m of a local point."""
        x, y, z = self._axes.to_ecef(east, north, up)
        x0, y0, z0 = self._origin
        return _geodetic(x0 + x, y0 + y, z0 + z)


class Wgs84Projection:
    """Horizontal part of the tangent plane of WGS84, for points at the altitude of the origin."""

    def __init__(self, lat: float, lon: float, alt: float = 0.0) -> None:
        """Set the origin (deg, m); ValueError where it is not usable."""
        self._tangent = LocalTangent(lat, lon, alt)
        self._alt = alt

    def project(self, lat: float, lon: float) -> tuple[float, float]:
        """Return (north, east) in m."""
        east, north, _ = self._tangent.to_enu(lat, lon, self._alt)
        return north, east

    def reproject(self, north: float, east: float) -> tuple[float, float]:
        """Return (latitude, longitude) in deg, longitude in [-180, 180).

        The plane leaves the surface of constant altitude as the square of the distance, so the
        height of the point is found by iteration; a point the plane cannot hold (over 6000 km)
        gives the nearest one.
        """
        up = -(north * north + east * east) / (2.0 * SPHERE_RADIUS)
        for _ in range(20):
            lat, lon, alt = self._tangent.to_geodetic(east, north, up)
            excess = alt - self._alt
            up -= excess
            if abs(excess) < 1e-4:
                break
        lat, lon, _ = self._tangent.to_geodetic(east, north, up)
        return lat, lon


@dataclass(frozen=True, slots=True)
class _Axes:
    sin_lat: float
    cos_lat: float
    sin_lon: float
    cos_lon: float

    @classmethod
    def at(cls, lat: float, lon: float) -> _Axes:
        phi = math.radians(lat)
        lam = math.radians(lon)
        return cls(math.sin(phi), math.cos(phi), math.sin(lam), math.cos(lam))

    def to_enu(self, x: float, y: float, z: float) -> tuple[float, float, float]:
        outward = self.cos_lon * x + self.sin_lon * y
        return (
            self.cos_lon * y - self.sin_lon * x,
            self.cos_lat * z - self.sin_lat * outward,
            self.cos_lat * outward + self.sin_lat * z,
        )

    def to_ecef(self, east: float, north: float, up: float) -> tuple[float, float, float]:
        outward = self.cos_lat * up - self.sin_lat * north
        return (
            self.cos_lon * outward - self.sin_lon * east,
            self.sin_lon * outward + self.cos_lon * east,
            self.sin_lat * up + self.cos_lat * north,
        )


def _ecef(lat: float, lon: float, alt: float) -> tuple[float, float, float]:
    phi = math.radians(lat)
    lam = math.radians(lon)
    sin_phi = math.sin(phi)
    prime_vertical = WGS84_A / math.sqrt(1.0 - WGS84_E2 * sin_phi * sin_phi)
    outward = (prime_vertical + alt) * math.cos(phi)
    up_axis = (prime_vertical * (1.0 - WGS84_E2) + alt) * sin_phi
    return outward * math.cos(lam), outward * math.sin(lam), up_axis


def _geodetic(x: float, y: float, z: float) -> tuple[float, float, float]:
    """Bowring (1976), "Transformation from spatial to geographical coordinates", two rounds."""
    outward = math.hypot(x, y)
    second_e2 = WGS84_E2 / (1.0 - WGS84_E2)
    beta = math.atan2(WGS84_A * z, WGS84_B * outward)
    phi = 0.0
    for _ in range(2):
        phi = math.atan2(
            z + second_e2 * WGS84_B * math.sin(beta) ** 3,
            outward - WGS84_E2 * WGS84_A * math.cos(beta) ** 3,
        )
        beta = math.atan2((1.0 - WGS84_F) * math.sin(phi), math.cos(phi))
    sin_phi = math.sin(phi)
    radius = WGS84_A * math.sqrt(1.0 - WGS84_E2 * sin_phi * sin_phi)
    alt = outward * math.cos(phi) + z * sin_phi - radius
    return math.degrees(phi), wrap_degrees(math.degrees(math.atan2(y, x))), alt


def _check_point(lat: float, lon: float) -> None:
    if not (math.isfinite(lat) and abs(lat) <= 90.0):
        raise ValueError(f'origin latitude {lat}: must be within -90 and 90 deg')
    if not (math.isfinite(lon) and abs(lon) <= 360.0):
        raise ValueError(f'origin longitude {lon}: must be within -360 and 360 deg')
