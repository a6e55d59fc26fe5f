"""Projections against pyproj and pymap3d."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from ekf_fusion_ros.geo.projection import LocalTangent
from ekf_fusion_ros.geo.projection import SphereProjection
from ekf_fusion_ros.geo.projection import Wgs84Projection
from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.geo.projection import wrap_degrees

ORIGINS = [(47.3977508, 8.5456074), (-33.9, 151.2), (0.0, 0.0), (64.1, 179.9995), (89.9, -20.0)]
OFFSETS = [(0.0, 0.0), (1e-7, -1e-7), (0.001, 0.002), (-0.05, 0.03), (0.09, -0.7)]

origin_lat = st.floats(-85.0, 85.0)
origin_lon = st.floats(-180.0, 180.0)
local = st.floats(-50e3, 50e3)


@pytest.mark.parametrize('origin', ORIGINS)
def test_sphere_is_azimuthal_equidistant(origin: tuple[float, float]) -> None:
    pyproj = pytest.importorskip('pyproj')
    lat0, lon0 = origin
    oracle = pyproj.Proj(proj='aeqd', lat_0=lat0, lon_0=lon0, R=6371000.0)
    ours = SphereProjection(lat0, lon0)
    for dlat, dlon in OFFSETS:
        lat = min(lat0 + dlat, 90.0)
        east, north = oracle(lon0 + dlon, lat)
        assert ours.project(lat, lon0 + dlon) == pytest.approx((north, east), abs=1e-6)
        lon_back, lat_back = oracle(east, north, inverse=True)
        got_lat, got_lon = ours.reproject(north, east)
        assert got_lat == pytest.approx(lat_back, abs=1e-10)
        slack = 1e-10 / max(math.cos(math.radians(lat)), 1e-9)
        assert abs(wrap_degrees(got_lon - lon_back)) < slack


@pytest.mark.parametrize('origin', ORIGINS)
@pytest.mark.parametrize('alt0', [-50.0, 0.0, 3000.0])
def test_tangent_plane_is_the_ellipsoids(origin: tuple[float, float], alt0: float) -> None:
    pymap3d = pytest.importorskip('pymap3d')
    lat0, lon0 = origin
    ours = LocalTangent(lat0, lon0, alt0)
    for dlat, dlon in OFFSETS:
        lat, lon, alt = min(lat0 + dlat, 90.0), lon0 + dlon, alt0 + 1e4 * dlat
        expected = pymap3d.geodetic2enu(lat, lon, alt, lat0, lon0, alt0)
        assert ours.to_enu(lat, lon, alt) == pytest.approx(expected, abs=2e-8)


@given(origin_lat, origin_lon, local, local, st.floats(-2e3, 1e4))
def test_tangent_plane_round_trip(
        lat0: float, lon0: float, east: float, north: float, up: float) -> None:
    plane = LocalTangent(lat0, lon0, 100.0)
    assert plane.to_enu(*plane.to_geodetic(east, north, up)) == pytest.approx(
        (east, north, up), abs=2e-8)


@given(st.sampled_from(['wgs84', 'sphere']), origin_lat, origin_lon, local, local)
def test_projection_round_trip(
        name: str, lat0: float, lon0: float, north: float, east: float) -> None:
    projection = make_projection(name, lat0, lon0)
    lat, lon = projection.reproject(north, east)
    assert -180.0 <= lon < 180.0
    assert projection.project(lat, lon) == pytest.approx((north, east), abs=1e-6)


def test_horizontal_wgs84_is_enu_at_the_origins_altitude() -> None:
    pymap3d = pytest.importorskip('pymap3d')
    east, north, _ = pymap3d.geodetic2enu(42.4, -71.1, 350.0, 42.376, -71.147, 350.0)
    assert Wgs84Projection(42.376, -71.147, 350.0).project(42.4, -71.1) == pytest.approx(
        (north, east), abs=1e-8)


def test_sphere_and_ellipsoid_differ_by_a_third_of_a_percent_here() -> None:
    sphere, _ = SphereProjection(42.376, -71.147).project(42.386, -71.147)
    ellipsoid, _ = Wgs84Projection(42.376, -71.147).project(42.386, -71.147)
    # Meridian radius of curvature at this latitude against the sphere's radius.
    curvature = 6378137.0 * (1 - 0.00669437999014) / (
        1 - 0.00669437999014 * math.sin(math.radians(42.381)) ** 2) ** 1.5
    assert sphere / ellipsoid == pytest.approx(6371000.0 / curvature, abs=1e-6)


def test_projection_crosses_the_antimeridian() -> None:
    for name in ('wgs84', 'sphere'):
        north, east = make_projection(name, 10.0, 179.999).project(10.0, -179.999)
        assert 200.0 < east < 240.0
        assert abs(north) < 0.01


@pytest.mark.parametrize('name', ['wgs84', 'sphere'])
@pytest.mark.parametrize(('lat', 'lon'), [(91.0, 0.0), (math.nan, 0.0), (0.0, math.inf)])
def test_bad_origin_is_named(name: str, lat: float, lon: float) -> None:
    with pytest.raises(ValueError, match='origin'):
        make_projection(name, lat, lon)


def test_unknown_projection_lists_the_choices() -> None:
    with pytest.raises(ValueError, match='wgs84, sphere'):
        make_projection('utm', 0.0, 0.0)


def test_a_point_the_plane_cannot_hold_stays_finite() -> None:
    assert all(map(math.isfinite, Wgs84Projection(10.0, 20.0).reproject(9e6, 0.0)))
