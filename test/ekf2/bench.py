"""A vehicle at rest on a bench whose sensors are set by hand, and the filter that hears them."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field
import math

import numpy as np

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.mathlib.rotation import matrix_from_euler_321
from ekf_fusion_ros.mathlib.rotation import quat_from_matrix
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import AirspeedSample
from ekf_fusion_ros.samples import Antenna
from ekf_fusion_ros.samples import AuxVelocitySample
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import FlowSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import RangeSample
from ekf_fusion_ros.samples import Sample
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.samples import VisionSample

GRAVITY = 9.80665
EARTH_FIELD = np.array((0.2, 0.0, 0.4))
STEP_US = 10_000
PERIODS_US = {'mag': 20_000, 'baro': 20_000, 'vision': 30_000, 'fix': 200_000, 'range': 50_000,
              'flow': 20_000, 'airspeed': 100_000, 'aux': 100_000}
METRES_PER_DEGREE = 111_180.0
"""Of latitude, on the ellipsoid at 47.36 N."""


@dataclass
class Fix:
    """What the receiver says."""

    lat: float = 47.3566094
    lon: float = 8.5190237
    alt: float = 422.056
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    nsats: int = 16
    pdop: float = 1.0
    eph: float = 0.5
    epv: float = 0.8
    sacc: float = 0.2
    yaw: float = math.nan
    yaw_offset: float = 0.0
    antenna: Antenna | None = None


@dataclass
class Odometry:
    """What the odometry says."""

    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    quaternion: np.ndarray = field(default_factory=lambda: np.array((1.0, 0.0, 0.0, 0.0)))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    position_var: np.ndarray = field(default_factory=lambda: np.full(3, 0.1))
    velocity_cov: np.ndarray = field(default_factory=lambda: 0.1 * np.eye(3))
    frame: VelocityFrame = VelocityFrame.LOCAL_FRD


@dataclass
class Flow:
    """What the camera sees: rate of the scene about x and y, minus the rate of the body."""

    rate: np.ndarray = field(default_factory=lambda: np.zeros(2))
    gyro: np.ndarray = field(default_factory=lambda: NAN3)
    quality: int = 255


class Bench:
    """Runs the filter on sensor values that hold until they are changed.

    `sending` names the sensors that are on, beside the IMU; `turned` is for tests that turn.
    """

    def __init__(self, params: Ekf2Params | None = None, roll: float = 0.0, pitch: float = 0.0,
                 yaw: float = 0.0) -> None:
        """Stand at an attitude in rad, with magnetometer and barometer on."""
        self.ekf = Ekf2(params)
        self.rot = matrix_from_euler_321(roll, pitch, yaw)
        self.rate = np.zeros(3)
        self.force = self.rot.T @ np.array((0.0, 0.0, -GRAVITY))
        self.field = self.rot.T @ EARTH_FIELD
        self.clipping = (False, False, False)
        self.altitude = 122.2
        self.fix = Fix()
        self.odometry = Odometry(quaternion=quat_from_matrix(self.rot))
        self.flow = Flow()
        self.distance = 0.2
        self.distance_quality = 100
        self.airspeed = 0.0
        self.aux_velocity = np.zeros(3)
        self.sending = {'mag', 'baro'}
        self.turned = 0.0
        self.now_us = 0

    def run(self, seconds: float) -> None:
        """Let time pass."""
        for _ in range(round(seconds * 1e6 / STEP_US)):
            self.now_us += STEP_US
            for sensor, period_us in PERIODS_US.items():
                if sensor in self.sending and self.now_us % period_us == 0:
                    self.ekf.push(self._sample(sensor))
            dt = 1e-6 * STEP_US
            self.ekf.push(ImuSample(self.now_us, self.rate * dt, self.force * dt, dt, dt,
                                    self.clipping))
            self.ekf.update()

    def travel(self, speed: float, seconds: float) -> None:
        """Let fixes go north, brought to a speed in m/s by 1 m/s^2 of the accelerometer."""
        dt, at_rest = 1e-6 * STEP_US, self.force
        for _ in range(round(seconds / dt)):
            before = self.fix.velocity[0]
            after = before + min(max(speed - before, -dt), dt)
            self.fix.velocity = np.array((after, 0.0, 0.0))
            self.fix.lat += dt * 0.5 * (before + after) / METRES_PER_DEGREE
            self.force = at_rest + self.rot.T @ np.array(((after - before) / dt, 0.0, 0.0))
            self.run(dt)
        self.force = at_rest

    def fly(self, *, on_wings: bool = False) -> None:
        """Tell the filter that the vehicle has left the ground."""
        self.ekf.push(LandedSample(self.now_us, landed=False, fixed_wing=on_wings,
                                   fuse_beta=on_wings))

    def _sample(self, sensor: str) -> Sample:
        if sensor == 'mag':
            return MagSample(self.now_us, self.field)
        if sensor == 'baro':
            return BaroSample(self.now_us, self.altitude)
        if sensor == 'fix':
            fix = self.fix
            return GnssSample(self.now_us, fix.lat, fix.lon, fix.alt, fix.eph, fix.epv,
                              fix.velocity.copy(), fix.sacc, nsats=fix.nsats, pdop=fix.pdop,
                              yaw=fix.yaw, yaw_offset=fix.yaw_offset, antenna=fix.antenna)
        if sensor == 'range':
            return RangeSample(self.now_us, self.distance, self.distance_quality)
        if sensor == 'flow':
            dt = 1e-6 * PERIODS_US['flow']
            return FlowSample(self.now_us, self.flow.rate * dt, self.flow.gyro * dt,
                              self.flow.quality, dt)
        if sensor == 'airspeed':
            return AirspeedSample(self.now_us, self.airspeed, 1.0)
        if sensor == 'aux':
            return AuxVelocitySample(self.now_us, self.aux_velocity.copy(), np.full(3, 0.01))
        odometry = self.odometry
        return VisionSample(self.now_us, odometry.position.copy(), odometry.quaternion.copy(),
                            odometry.velocity.copy(), odometry.position_var.copy(),
                            odometry.velocity_cov.copy(), 0.05, odometry.frame)

    @property
    def flags(self) -> set[str]:
        """Names of the flags that are set."""
        flags = self.ekf.filter.flags
        return {name for name in flags.__slots__ if getattr(flags, name)}

    @property
    def x(self) -> np.ndarray:
        """The state."""
        return self.ekf.filter.x

    @property
    def p(self) -> np.ndarray:
        """The variances."""
        return np.diag(self.ekf.filter.cov.p)

    @property
    def attitude(self) -> np.ndarray:
        """Roll, pitch, yaw of the state, rad."""
        w, x, y, z = self.x[0:4]
        return np.array((np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
                         np.arcsin(np.clip(2 * (w * y - x * z), -1.0, 1.0)),
                         np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))))

    @property
    def resets(self):
        """The reset counters."""
        return self.ekf.control.resets.counters
