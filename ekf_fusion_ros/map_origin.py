"""The origin of the map where the parameters fix it, and points of the map on the earth."""

from __future__ import annotations

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.params.session import SessionParams

LARGEST_DISTANCE = 1e6
"""Distance in m from the origin beyond which a plane is no map of the earth."""


def fixed_origin(params: SessionParams) -> GeoPoint | None:
    """Return the origin that the parameters give, None where the first good fix sets it.

    Raises ValueError for a point that is not on the earth, and where none is given.
    """
    if params.origin_from != 'parameter':
        return None
    if params.origin == SessionParams().origin:
        raise ValueError("session.origin_from = 'parameter': give session.origin too, latitude "
                         'and longitude in deg and altitude in m')
    origin = GeoPoint(*params.origin)
    if not origin.on_earth:
        raise ValueError(f'session.origin = {params.origin}: give latitude within -90 .. 90 deg, '
                         'longitude within -180 .. 180 deg and altitude in m')
    return origin


def map_of_point(
    point: GeoPoint, origin: GeoPoint, projection: str,
) -> tuple[float, float, float]:
    """Return x east, y north, z up in m of a point, in the map about an origin.

    Raises ValueError, saying why, for a point that has no place in the map.
    """
    if not point.on_earth:
        raise ValueError(f'latitude {point.lat}, longitude {point.lon}, altitude {point.alt}: '
                         'not a point of the earth')
    # Measured along the sphere: on a tangent plane the far side of the earth is near again.
    _check_distance(*make_projection('sphere', origin.lat, origin.lon).project(
        point.lat, point.lon))
    north, east = make_projection(projection, origin.lat, origin.lon, origin.alt).project(
        point.lat, point.lon)
    return east, north, point.alt - origin.alt


def point_of_map(
    x: float, y: float, z: float, origin: GeoPoint, projection: str,
) -> GeoPoint:
    """Return the point at x east, y north, z up in m of the map about an origin.

    Raises ValueError, saying why, for coordinates beyond the map.
    """
    _check_distance(x, y, z)
    lat, lon = make_projection(projection, origin.lat, origin.lon, origin.alt).reproject(y, x)
    return GeoPoint(lat, lon, origin.alt + z)


def _check_distance(*coordinates: float) -> None:
    if not all(abs(value) <= LARGEST_DISTANCE for value in coordinates):
        numbers = ', '.join(f'{value:g}' for value in coordinates)
        raise ValueError(f'({numbers}) m: farther than {LARGEST_DISTANCE:g} m from the origin of '
                         'the map')
