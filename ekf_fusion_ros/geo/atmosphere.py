"""Pressure and pressure altitude in the troposphere of the standard atmosphere (ISO 2533)."""

from __future__ import annotations

import math

SEA_LEVEL_PRESSURE = 101325.0
SEA_LEVEL_TEMPERATURE = 288.15
LAPSE_RATE = 0.0065
GAS_CONSTANT = 287.05287
GRAVITY = 9.80665
TROPOPAUSE = 11000.0
_EXPONENT = LAPSE_RATE * GAS_CONSTANT / GRAVITY


def pressure_altitude(pressure: float, reference: float = SEA_LEVEL_PRESSURE) -> float:
    """Return the altitude in m above the level of `reference`, both in Pa.

    Raises ValueError unless both are positive.
    """
    if not (pressure > 0.0 and reference > 0.0):
        raise ValueError(f'pressure {pressure} Pa over {reference} Pa: both must be positive')
    ratio = (pressure / reference) ** _EXPONENT
    return SEA_LEVEL_TEMPERATURE / LAPSE_RATE * (1.0 - float(ratio))


def pressure_at(altitude: float, reference: float = SEA_LEVEL_PRESSURE) -> float:
    """Return the pressure in Pa at an altitude in m above the level of `reference`."""
    ratio = 1.0 - LAPSE_RATE * altitude / SEA_LEVEL_TEMPERATURE
    return reference * float(ratio ** (1.0 / _EXPONENT))


def true_from_equivalent(altitude: float, temperature_offset: float = 0.0) -> float:
    """Return the factor from equivalent to true airspeed: sqrt(density at sea level / here).

    altitude m of pressure, up to the tropopause; temperature_offset K above the standard's.
    """
    level = min(altitude, TROPOPAUSE)
    temperature = SEA_LEVEL_TEMPERATURE - LAPSE_RATE * level
    pressure_ratio = pressure_at(level) / SEA_LEVEL_PRESSURE
    temperature_ratio = (temperature + temperature_offset) / SEA_LEVEL_TEMPERATURE
    return math.sqrt(temperature_ratio / pressure_ratio)
