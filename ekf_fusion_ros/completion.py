"""Readings that lack something become samples by what other messages tell."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING
from typing import Any

from ekf_fusion_ros.geo.atmosphere import true_from_equivalent
from ekf_fusion_ros.messages.decode_airspeed import AirspeedReading
from ekf_fusion_ros.messages.decode_flow import FlowIntegrator
from ekf_fusion_ros.messages.decode_flow import FlowReading
from ekf_fusion_ros.samples import AirspeedSample
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import GnssSample

if TYPE_CHECKING:
    from ekf_fusion_ros.params.messages import MessageParams


class Completion:
    """Gives flow its interval and airspeed its density. Takes everything in order of stamps.

    The density is that of the standard atmosphere at the newest pressure altitude, at the altitude
    of the newest fix where there is no pressure, and at sea level before either.
    """

    def __init__(self, params: MessageParams) -> None:
        self._params = params.airspeed
        self._flow = FlowIntegrator(params.flow)
        self._fix_altitude = 0.0
        self._pressure_altitude: float | None = None

    def sample(self, reading: Any) -> Any:
        """Return the sample that the estimator takes; whole samples pass as they are."""
        if isinstance(reading, BaroSample):
            self._pressure_altitude = reading.altitude
        elif isinstance(reading, FlowReading):
            return self._flow.push(reading)
        elif isinstance(reading, AirspeedReading):
            return self._airspeed(reading)
        return reading

    def note_fix(self, fix: GnssSample) -> None:
        """Take the altitude of a fix."""
        if math.isfinite(fix.alt):
            self._fix_altitude = fix.alt

    def _airspeed(self, reading: AirspeedReading) -> AirspeedSample:
        altitude = self._pressure_altitude
        factor = true_from_equivalent(
            self._fix_altitude if altitude is None else altitude, self._params.temperature_offset)
        equivalent = self._params.kind == 'equivalent'
        speed = reading.speed * factor if equivalent else reading.speed
        return AirspeedSample(reading.time_us, speed, factor)
