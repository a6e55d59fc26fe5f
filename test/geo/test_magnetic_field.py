"""Field table against the published numbers of the reference, WMM against its test values."""

from __future__ import annotations

import math
import sys

import pytest

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.geo.magnetic_field import EclFieldTable
from ekf_fusion_ros.geo.magnetic_field import FieldPoint
from ekf_fusion_ros.geo.magnetic_field import WmmField
from ekf_fusion_ros.geo.magnetic_field import make_field
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.session import FusionSession


@pytest.mark.parametrize(('lat', 'lon', 'expected'), [
    (47.3977508, 8.5456074, (0.05041, 1.10129, 0.48078)),
    (8.5456074, 47.3977508, (0.00971, 0.06459, 0.36755)),
])
def test_table_gives_the_references_numbers(
        lat: float, lon: float, expected: tuple[float, float, float]) -> None:
    point = EclFieldTable.load().lookup(lat, lon)
    assert (point.declination, point.inclination, point.strength) == pytest.approx(
        expected, abs=6e-6)


def test_table_edges_and_longitudes_beyond_the_seam() -> None:
    table = EclFieldTable.load()
    corner = table.lookup(90.0, 180.0)
    assert (corner.declination, corner.inclination, corner.strength) == (-3.0329, 1.5391, 0.5679)
    assert table.lookup(12.0, 190.0) == table.lookup(12.0, -170.0)
    assert table.lookup(-33.0, -185.0) == table.lookup(-33.0, 175.0)


@pytest.mark.parametrize(('lat', 'lon'), [(90.1, 0.0), (math.nan, 0.0), (0.0, math.nan)])
def test_places_off_the_earth_are_refused(lat: float, lon: float) -> None:
    with pytest.raises(ValueError, match='not a place on the earth'):
        EclFieldTable.load().lookup(lat, lon)


@pytest.mark.parametrize(('year', 'lat', 'lon', 'declination', 'inclination', 'nanotesla'), [
    # Test values published with WMM2020 and WMM2025, at sea level.
    (2020.0, 80.0, 0.0, -1.28, 83.14, 55000.1),
    (2025.0, 80.0, 0.0, 1.28, 83.21, 55178.5),
])
def test_wmm_gives_the_models_test_values(
        year: float, lat: float, lon: float, declination: float, inclination: float,
        nanotesla: float) -> None:
    pytest.importorskip('pygeomag')
    point = WmmField(year).lookup(lat, lon)
    assert math.degrees(point.declination) == pytest.approx(declination, abs=0.006)
    assert math.degrees(point.inclination) == pytest.approx(inclination, abs=0.006)
    assert point.strength == pytest.approx(nanotesla * 1e-5, abs=2e-6)


@pytest.mark.parametrize(
    ('lat', 'lon'), [(47.4, 8.5), (-33.9, 151.2), (42.4, -71.1), (1.3, 103.8)])
def test_table_and_model_agree_at_mid_latitudes(lat: float, lon: float) -> None:
    pytest.importorskip('pygeomag')
    table = EclFieldTable.load().lookup(lat, lon)
    model = WmmField(2021.0).lookup(lat, lon)
    assert math.degrees(abs(table.declination - model.declination)) < 1.0
    assert math.degrees(abs(table.inclination - model.inclination)) < 1.0
    assert abs(table.strength - model.strength) < 0.01


def direction(point: FieldPoint) -> tuple[float, float, float]:
    level = math.cos(point.inclination)
    return (level * math.cos(point.declination), level * math.sin(point.declination),
            math.sin(point.inclination))


def test_table_and_model_agree_between_the_nodes_of_the_table() -> None:
    """Nodes are 10 degrees apart; interpolation and a year cost 1.5 degrees and 3 %."""
    pytest.importorskip('pygeomag')
    table, model = EclFieldTable.load(), WmmField(2021.0)
    for lat in range(-54, 67, 12):
        for lon in range(-175, 180, 15):
            found, true = table.lookup(lat, lon), model.lookup(lat, lon)
            apart = math.dist(direction(found), direction(true))
            assert math.degrees(apart) < 1.5, (lat, lon)
            assert found.strength == pytest.approx(true.strength, rel=0.03), (lat, lon)


def test_wmm_covers_every_model_and_clamps_other_years() -> None:
    pytest.importorskip('pygeomag')
    for year in (2012.5, 2017.5, 2022.5, 2027.5):
        assert 0.2 < WmmField(year).lookup(47.0, 8.0).strength < 0.7
    assert WmmField(1970.0).lookup(47.0, 8.0) == WmmField(2010.0).lookup(47.0, 8.0)
    assert WmmField(2050.0).year == pytest.approx(2030.0, abs=0.02)


def test_unknown_model_lists_the_choices() -> None:
    with pytest.raises(ValueError, match='ecl_table, wmm'):
        make_field('igrf', 2025.0)


def test_without_pygeomag_an_estimator_is_not_made(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'pygeomag', None)
    params = with_overrides(Params(), {'ekf2.mag.field_model': 'wmm'})
    for make in (lambda: Ekf2(params.ekf2), lambda: FusionSession(params, ('imu', 'fix'))):
        with pytest.raises(ValueError, match=r'^ekf2\.mag\.field_model = .* pygeomag'):
            make()
    FusionSession(with_overrides(params, {'estimator': 'lpe'}), ('imu', 'fix'))
