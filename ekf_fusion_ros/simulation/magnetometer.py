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
from ekf_fusion_ros.simulation.trajectory import GRAVITY
from ekf_fusion_ros.simulation.trajectory import Trajectory

GROUND_CLEARANCE = 0.1


@dataclass(frozen=True, kw_only=True)
class Magnetometer(Sensor):
    """Earth field seen from the body, a constant body field and white noise, in Gauss.

    In the air the current of the motors adds `motor_field` for each g of specific force.
    """

    earth_field: Vector
    rate: float = 50.0
    body_field: Vector = ZERO
    motor_field: Vector = ZERO
    field_noise: float = 0.003

    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[MagSample]:
        instants = self.instants_us(trajectory)
        motion = trajectory.motion(instants * 1e-6)
        north, east, down = motion.position.T
        airborne = trajectory.terrain.down(north, east) - down > GROUND_CLEARANCE
        thrust = airborne * np.linalg.norm(motion.specific_force, axis=1) / GRAVITY
        field = motion.to_body(np.array(self.earth_field)) + np.array(self.body_field)
        field += np.outer(thrust, self.motor_field)
        field += noise.white(rng, self.field_noise, field.shape)
        stamps = self.stamps(instants, start_us)
        return [MagSample(stamps[k], field[k]) for k in np.flatnonzero(self.present(instants))]


def earth_field(point: FieldPoint) -> Vector:
    """Return the field vector NED in Gauss of a declination, inclination and strength."""
    horizontal = point.strength * math.cos(point.inclination)
    return (
        horizontal * math.cos(point.declination), horizontal * math.sin(point.declination),
        point.strength * math.sin(point.inclination))
