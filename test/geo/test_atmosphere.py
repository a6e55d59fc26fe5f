"""Standard atmosphere against its published table (ISO 2533, geopotential altitude)."""

from __future__ import annotations

import pytest

from ekf_fusion_ros.geo.atmosphere import pressure_altitude
from ekf_fusion_ros.geo.atmosphere import pressure_at
from ekf_fusion_ros.geo.atmosphere import true_from_equivalent

TABLE = [(0.0, 101325.0), (1000.0, 89874.6), (5000.0, 54019.9), (11000.0, 22632.1)]


@pytest.mark.parametrize(('altitude', 'pressure'), TABLE)
def test_against_the_standard(altitude: float, pressure: float) -> None:
    assert pressure_at(altitude) == pytest.approx(pressure, abs=0.07)
    assert pressure_altitude(pressure) == pytest.approx(altitude, abs=0.03)


def test_reference_pressure_is_zero_altitude() -> None:
    assert pressure_altitude(95000.0, 95000.0) == 0.0


@pytest.mark.parametrize('pressure', [0.0, -1.0, float('nan')])
def test_pressure_must_be_positive(pressure: float) -> None:
    with pytest.raises(ValueError, match='must be positive'):
        pressure_altitude(pressure)


@pytest.mark.parametrize(
    ('altitude', 'density'), [(0.0, 1.2250), (1000.0, 1.11166), (5000.0, 0.736116),
                              (11000.0, 0.363918), (50000.0, 0.363918)])
def test_true_airspeed_goes_with_the_root_of_density(altitude: float, density: float) -> None:
    assert true_from_equivalent(altitude) == pytest.approx((1.2250 / density) ** 0.5, rel=1e-5)
