"""Earth magnetic field: the reference filter's table, or the World Magnetic Model."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib import import_module
from importlib import resources
import math
from typing import Any
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

TABLE_STEP_DEG = 10.0
GAUSS_PER_NANOTESLA = 1e-5
FIRST_YEAR = 2010.0
LAST_YEAR = 2029.99


@dataclass(frozen=True, slots=True)
class FieldPoint:
    """Declination and inclination in rad (east and down positive), strength in Gauss."""

    declination: float
    inclination: float
    strength: float


class MagneticField(Protocol):
    """Where the field at a place comes from."""

    def lookup(self, lat: float, lon: float) -> FieldPoint:
        """Return the field at sea level at a latitude and longitude in deg."""


def check_field(name: str) -> None:
    """Raise ValueError for a model whose package is missing, before anything hangs on it."""
    if name == 'wmm':
        _pygeomag()


def make_field(name: str, decimal_year: float) -> MagneticField:
    """Return the model called `name` ('ecl_table' or 'wmm'); the table knows no year.

    Raises ValueError on an unknown name, and where pygeomag is missing.
    """
    if name == 'ecl_table':
        return EclFieldTable.load()
    if name == 'wmm':
        return WmmField(decimal_year)
    raise ValueError(f'field model {name!r}: choose one of ecl_table, wmm')


class EclFieldTable:
    """A grid of 10 deg interpolated bilinearly, as PX4-ECL of 2021 ships it."""

    def __init__(self, values: NDArray[np.float64]) -> None:
        """Take values (19, 37, 3): from -90, -180 deg; declination, inclination, strength."""
        if values.shape != (19, 37, 3) or not np.all(np.isfinite(values)):
            raise ValueError(f'field table {values.shape}: must be (19, 37, 3) finite numbers')
        self._values = values

    @classmethod
    def load(cls) -> EclFieldTable:
        """Read the table that ships with the package."""
        path = resources.files('ekf_fusion_ros') / 'geo' / 'ecl_field_table.csv'
        with path.open(encoding='utf-8') as stream:
            rows = list(csv.reader(stream))[1:]
        values = np.array(rows, dtype=np.float64)
        return cls(values[:, 2:].reshape(19, 37, 3))

    def lookup(self, lat: float, lon: float) -> FieldPoint:
        """Return the field at a latitude and longitude in deg; along the longitude first.

        Raises ValueError where the place is not on the earth.
        """
        lat, lon = _normalised(lat, lon)
        row = min(int((lat + 90.0) // TABLE_STEP_DEG), 17)
        column = min(int((lon + 180.0) // TABLE_STEP_DEG), 35)
        along = (lon + 180.0) / TABLE_STEP_DEG - column
        across = (lat + 90.0) / TABLE_STEP_DEG - row
        cell = self._values[row:row + 2, column:column + 2]
        edges = cell[:, 0] + along * (cell[:, 1] - cell[:, 0])
        south, north = edges
        return FieldPoint(*(south + across * (north - south)).tolist())


class WmmField:
    """World Magnetic Model through pygeomag, at sea level and one date."""

    def __init__(self, decimal_year: float) -> None:
        """Set the date; ValueError without pygeomag.

        A year outside the models' (2010 to 2030), such as that of a simulation clock, counts as
        the nearest one inside; `year` is the one in use.
        """
        pygeomag = _pygeomag()
        self.year = min(max(decimal_year, FIRST_YEAR), LAST_YEAR)
        model_year = int(self.year // 5.0) * 5
        self._model = pygeomag.GeoMag(base_year=model_year)

    def lookup(self, lat: float, lon: float) -> FieldPoint:
        """Return the field at a latitude and longitude in deg.

        Raises ValueError where the place is not on the earth.
        """
        lat, lon = _normalised(lat, lon)
        result = self._model.calculate(glat=lat, glon=lon, alt=0.0, time=self.year)
        return FieldPoint(
            math.radians(result.d), math.radians(result.i), result.f * GAUSS_PER_NANOTESLA)


def _pygeomag() -> Any:
    try:
        return import_module('pygeomag')
    except ImportError as error:
        raise ValueError(
            "ekf2.mag.field_model = 'wmm': needs the package pygeomag, which is not installed: "
            "pip install 'ekf_fusion_ros[geo]', or choose ecl_table") from error


def _normalised(lat: float, lon: float) -> tuple[float, float]:
    if not (math.isfinite(lat) and abs(lat) <= 90.0 and math.isfinite(lon) and abs(lon) <= 360.0):
        raise ValueError(f'latitude {lat}, longitude {lon}: not a place on the earth')
    if lon > 180.0:
        lon -= 360.0
    elif lon < -180.0:
        lon += 360.0
    return lat, lon
