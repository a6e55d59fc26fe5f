"""What all parts of the filter share: states, flags, clocks and records."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.covariance import Covariance
from ekf_fusion_ros.ekf2.delayed_imu import DelayedImu
from ekf_fusion_ros.ekf2.earth import EarthReference
from ekf_fusion_ros.ekf2.events import EventLog
from ekf_fusion_ros.ekf2.flags import ControlFlags
from ekf_fusion_ros.ekf2.flags import FaultFlags
from ekf_fusion_ros.ekf2.flags import FusionTimes
from ekf_fusion_ros.ekf2.flags import Rejections
from ekf_fusion_ros.ekf2.output_predictor import OutputPredictor
from ekf_fusion_ros.ekf2.state import FILTER_PERIOD
from ekf_fusion_ros.ekf2.state import SIZE
from ekf_fusion_ros.observation import Observation
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.samples import NO_CLIPPING
from ekf_fusion_ros.samples import AirspeedSample
from ekf_fusion_ros.samples import Antenna
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]


MIN_PERIOD = 2.5e-3
"""Interval in s below which an increment says nothing about a rate."""

class GnssFix(NamedTuple):
    """A fix in the local frame: NE position (2,) m, altitude m, NED velocity (3,) m/s.

    antenna: lever arms (3,) from the IMU, None where they are those of the parameters.
    """

    time_us: int
    position: Array
    altitude: float
    velocity: Array
    hacc: float
    vacc: float
    sacc: float
    has_velocity: bool
    lat: float
    lon: float
    yaw: float = math.nan
    yaw_offset: float = 0.0
    antenna: Antenna | None = None


class VerticalCheck(NamedTuple):
    """Normalised innovation of the latest vertical velocity or position, and its time."""

    ratio: float = 0.0
    time_us: int = 0


class Observations:
    """One record per kind of observation."""

    def __init__(self) -> None:
        """Start with nothing tried."""
        self.gps_hor_vel = Observation('gnss_velocity', 2)
        self.gps_ver_vel = Observation('gnss_vertical_velocity')
        self.gps_hor_pos = Observation('gnss_position', 2)
        self.gps_height = Observation('gnss_height')
        self.ev_hor_vel = Observation('vision_velocity', 2)
        self.ev_ver_vel = Observation('vision_vertical_velocity')
        self.ev_hor_pos = Observation('vision_position', 2)
        self.ev_height = Observation('vision_height')
        self.baro_height = Observation('baro_height')
        self.yaw = Observation('yaw')
        self.mag = Observation('magnetic_field', 3)
        self.declination = Observation('declination')
        self.fake_pos = Observation('fake_position', 2)
        self.fake_height = Observation('fake_height')
        self.range_height = Observation('range_height')
        self.hagl = Observation('height_above_ground')
        self.flow = Observation('optical_flow', 2)
        self.airspeed = Observation('airspeed')
        self.sideslip = Observation('sideslip')
        self.drag = Observation('drag', 2)
        self.aux_vel = Observation('auxiliary_velocity', 2)

    def all(self) -> list[Observation]:
        """Return every record."""
        return list(vars(self).values())


class Filter:
    """The state of the estimator, shared by prediction, aid sources and resets.

    `x` holds the 24 states in the order of state.py, `cov` owns their covariance. `rot` is the
    body to earth matrix cached at the prediction; measurement updates do not refresh it, so that
    all lever arms of one step use the same attitude.
    """

    def __init__(self, params: Ekf2Params, history: int) -> None:
        """Start level at rest; history is the number of filter periods back to the horizon."""
        self.adopt(params)
        self.x: Array = np.zeros(SIZE)
        self.x[0] = 1.0
        self.cov = Covariance(params)
        self.rot: Array = np.eye(3)
        self.imu = DelayedImu(0, np.zeros(8), NO_CLIPPING)
        self.t_now = 0
        self.t_horizon = 0
        self.dt_avg = FILTER_PERIOD
        self.accel_lpf = self.cov.accel_lpf
        self.travel = self.cov.travel
        self.flags = ControlFlags()
        self.gps_hgt_before = False
        self.rng_hgt_before = False
        self.faults = FaultFlags()
        self.rejections = Rejections()
        self.times = FusionTimes()
        self.observations = Observations()
        self.events = EventLog()
        self.earth = EarthReference(params.earth.projection, params.mag.field_model)
        self.output = OutputPredictor(params.output, history)
        self.ver_vel_check = VerticalCheck()
        self.ver_pos_check = VerticalCheck()
        self.last_on_ground_us = 0
        self.last_in_air_us = 0
        self.last_known_position = np.zeros(2)
        self.fix: GnssFix | None = None
        self.vision: VisionSample | None = None
        self.airspeed: AirspeedSample | None = None
        self.airspeed_us = 0
        self.airspeed_popped = False
        self.covariance_lost = False
        self.rot_ev: Array = np.eye(3)
        self.last_velocity: Sequence[float] = (0.0, 0.0)
        self.last_velocity_variance: Sequence[float] = (0.0, 0.0)
        self.holding_position = False
        self.dead_reckoning = True
        self.wind_dead_reckoning = False
        self.last_aiding_us = 0
        self.yaw_reset_requested = False
        self.north_wanted_us = 0

    def adopt(self, params: Ekf2Params) -> None:
        """Go by these parameters, and by the lever arms of their mounting, from now on."""
        self.params = params
        self.gnss_lever = lever_arm(params.gnss.position, params)
        self.vision_lever = lever_arm(params.vision.position, params)
        self.range_lever = lever_arm(params.range.position, params)
        self.flow_lever = lever_arm(params.flow.position, params)

    def late(self, stamp_us: int, timeout_us: int) -> bool:
        """True when more than a timeout has passed since a stamp."""
        return stamp_us + timeout_us < self.t_now

    def recent(self, stamp_us: int, timeout_us: int) -> bool:
        """True when less than a timeout has passed since a stamp."""
        return stamp_us + timeout_us > self.t_now

    @property
    def rate(self) -> Array:
        """Body rate (3,) in rad/s at the horizon, bias not removed."""
        increments = self.imu.increments
        rate: Array = increments[0:3] / max(float(increments[6]), MIN_PERIOD)
        return rate

    @property
    def position(self) -> Array:
        """Position (3,) NED in m."""
        return self.x[7:10]

    @property
    def velocity(self) -> Array:
        """Velocity (3,) NED in m/s."""
        return self.x[4:7]


def lever_arm(sensor: tuple[float, float, float], params: Ekf2Params) -> Array | None:
    """Return the vector (3,) from the IMU to a sensor in the body, None where they coincide."""
    lever = np.subtract(sensor, params.imu.position)
    return lever if lever.any() else None
