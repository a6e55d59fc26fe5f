"""A trajectory and the sensors that watch it."""

from __future__ import annotations

from collections.abc import Collection
from collections.abc import Iterator
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.geo.magnetic_field import EclFieldTable
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import Sample
from ekf_fusion_ros.simulation.airspeed import Airspeed
from ekf_fusion_ros.simulation.auxiliary_velocity import AuxiliaryVelocity
from ekf_fusion_ros.simulation.barometer import Barometer
from ekf_fusion_ros.simulation.dual_antenna import DualAntennaGnss
from ekf_fusion_ros.simulation.gnss import Gnss
from ekf_fusion_ros.simulation.ground_contact import Arming
from ekf_fusion_ros.simulation.ground_contact import GroundContact
from ekf_fusion_ros.simulation.imu import Imu
from ekf_fusion_ros.simulation.magnetometer import Magnetometer
from ekf_fusion_ros.simulation.magnetometer import earth_field
from ekf_fusion_ros.simulation.optical_flow import OpticalFlow
from ekf_fusion_ros.simulation.range_finder import RangeFinder
from ekf_fusion_ros.simulation.sensor import Sensor
from ekf_fusion_ros.simulation.sensor import Vector
from ekf_fusion_ros.simulation.trajectory import Trajectory
from ekf_fusion_ros.simulation.vision import Vision

ORIGIN = GeoPoint(47.397742, 8.545594, 488.0)
START_US = 1_700_000_000_000_000
ROLES = ('odometry', 'fix', 'imu', 'magnetic_field', 'pressure')
FURTHER_ROLES = ('range', 'flow', 'airspeed', 'landed', 'aux_velocity', 'armed')
FURTHER_RECEIVERS = ('fix_2', 'fix_3')
ARMED_AT = 15.0
"""Time in s at which a simulated vehicle is armed: the estimate has settled by then."""

GPS_HEADING = 'gps_heading'
"""No sensor of its own: a receiver with two antennas tells it with the fix."""

# Each role keeps its random numbers whatever roles are added to the lists.
STREAMS = {role: number for first, roles in (
    (0, ROLES), (100, FURTHER_ROLES), (200, FURTHER_RECEIVERS))
           for number, role in enumerate(roles, first)}


class Arrival(NamedTuple):
    """A sample, the role of its topic, and the time in us at which its message arrives."""

    time_us: int
    role: str
    sample: Sample


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """Sensors by role on a trajectory that starts at `origin` and `start_us`.

    Each sensor draws from a stream of its own, so that adding one leaves the others as they are.
    """

    trajectory: Trajectory
    sensors: Mapping[str, Sensor]
    origin: GeoPoint = ORIGIN
    start_us: int = START_US
    seed: int = 0

    def __post_init__(self) -> None:
        for role in self.sensors:
            if role not in STREAMS:
                raise ValueError(f'sensor role {role!r}: choose one of {", ".join(STREAMS)}')

    def arrivals(self) -> Iterator[Arrival]:
        """Yield all samples in the order of arrival; at equal times IMU samples come last."""
        everything: list[Arrival] = []
        for role, sensor in self.sensors.items():
            rng = np.random.default_rng([self.seed, STREAMS[role]])
            latency = round(sensor.latency * 1e6)
            everything += [
                Arrival(sample.time_us + latency, role, sample)
                for sample in sensor.measure(self.trajectory, self.start_us, rng)
            ]
        everything.sort(key=lambda a: (a.time_us, isinstance(a.sample, ImuSample)))
        yield from everything


def default_sensors(
    roles: Collection[str] = ROLES, origin: GeoPoint = ORIGIN,
) -> dict[str, Sensor]:
    """Return one sensor of usual quality for each of the roles; replace entries as needed.

    `gps_heading` among the roles gives the receiver of `fix` a second antenna.
    """
    receiver = DualAntennaGnss if GPS_HEADING in roles else Gnss
    everything: dict[str, Sensor] = {
        'odometry': Vision(),
        'fix': receiver(origin=origin),
        'imu': Imu(),
        'magnetic_field': Magnetometer(earth_field=field_at(origin)),
        'pressure': Barometer(reference=origin.alt),
        'range': RangeFinder(),
        'flow': OpticalFlow(),
        'airspeed': Airspeed(reference=origin.alt),
        'landed': GroundContact(),
        'aux_velocity': AuxiliaryVelocity(),
        'armed': Arming(armed_at=ARMED_AT),
        'fix_2': Gnss(origin=origin),
        'fix_3': Gnss(origin=origin),
    }
    return {role: everything[role] for role in roles if role != GPS_HEADING}


def field_at(origin: GeoPoint) -> Vector:
    """Return the earth's magnetic field NED in Gauss, from the packaged table."""
    return earth_field(EclFieldTable.load().lookup(origin.lat, origin.lon))
