"""Magnetometer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np

from ekf_fusion_ros.geo.magnetic_field import FieldPoint
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.simulation import noise
from ekf_fusion_ros.simulation.sensor import ZERO
from ekf_fusion_ros.simulation.sensor import Sensor
from ekf_fusion_ros.simulation.sensor import Vector
from ekf_fusion_ros.simulation.trajectory import Trajectory


@dataclass(frozen=True, kw_only=True)
class Magnetometer(Sensor):
    """Earth field seen from the body plus a constant body field and white noise, in Gauss."""

    earth_field: Vector
    rate: float = 50.0
    body_field: Vector = ZERO
    field_noise: float = 0.003

    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[MagSample]:
        instants = self.instants_us(trajectory)
        field = trajectory.motion(instants * 1e-6).to_body(np.array(self.earth_field))
        field = field + np.array(self.body_field)
        field += noise.white(rng, self.field_noise, field.shape)
        stamps = self.stamps(instants, start_us)
        return [MagSample(stamps[k], field[k]) for k in np.flatnonzero(self.present(instants))]


def earth_field(point: FieldPoint) -> Vector:
    """Return the field vector NED in Gauss of a declination, inclination and strength."""
    horizontal = point.strength * math.cos(point.inclination)
    return (
        horizontal * math.cos(point.declination), horizontal * math.sin(point.declination),
        point.strength * math.sin(point.inclination))
