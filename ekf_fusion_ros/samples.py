"""Measurements as the estimators take them: NED/FRD, SI units, integer microseconds.

Stamps (`time_us`) are those of the message; the estimator applies its sensor delays. Missing
scalars and vectors are NaN, so that "not measured" can never be mistaken for zero.
"""

from __future__ import annotations

from enum import Enum
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
NAN3 = np.full(3, math.nan)
NAN3.flags.writeable = False
NAN4 = np.full(4, math.nan)
NAN4.flags.writeable = False
UNTOLD_POSITION_VAR = np.full(3, 0.1)
UNTOLD_POSITION_VAR.flags.writeable = False
UNTOLD_VELOCITY_COV = 0.1 * np.eye(3)
UNTOLD_VELOCITY_COV.flags.writeable = False
NO_CLIPPING = (False, False, False)
TRAVELLING_SPEED = 1.0
SIGNIFICANT = 3.0
"""m/s and sigmas above which a speed is none of a body at rest."""


def travels(velocity: Array, sacc: float) -> bool:
    """True where the horizontal velocity of a fix with 1-sigma sacc, m/s, is not that of rest."""
    speed = math.hypot(float(velocity[0]), float(velocity[1]))
    return speed > max(TRAVELLING_SPEED, SIGNIFICANT * sacc)


class VelocityFrame(Enum):
    """Frame of an external-vision velocity."""

    LOCAL_FRD = 0
    BODY_FRD = 1


class ImuSample(NamedTuple):
    """Inertial increments over the interval that ends at `time_us`, body FRD.

    delta_angle (3,) rad, coning-corrected where the source can; delta_velocity (3,) m/s,
    specific force times interval (at rest about -9.81 dt on z); intervals in s; `clipping` marks
    accelerometer axes that hit their range. orientation (4,) w, x, y, z body to NED at the end,
    None where the source has none.
    """

    time_us: int
    delta_angle: Array
    delta_velocity: Array
    delta_angle_dt: float
    delta_velocity_dt: float
    clipping: tuple[bool, bool, bool] = NO_CLIPPING
    orientation: Array | None = None


class Antenna(NamedTuple):
    """Place of the antenna in the body, (3,) m FRD, for each kind of measurement of a fix.

    They differ where a fix is a mean of several receivers, each kind with weights of its own.
    """

    position: Array
    height: Array
    velocity: Array


class GnssSample(NamedTuple):
    """A GNSS fix.

    lat, lon deg; alt m in the datum of the source; velocity (3,) m/s NED; eph, epv 1-sigma m;
    sacc 1-sigma m/s; fix_type 3 = 3-D; nsats, pdop None where the source has none;
    yaw rad of the vehicle from two antennas, the angle of their axis in the body, and 1-sigma rad;
    antenna None where it is the one that the parameters place.
    """

    time_us: int
    lat: float
    lon: float
    alt: float
    eph: float
    epv: float
    velocity: Array = NAN3
    sacc: float = math.nan
    fix_type: int = 3
    nsats: int | None = None
    pdop: float | None = None
    yaw: float = math.nan
    yaw_offset: float = 0.0
    yaw_accuracy: float = math.nan
    antenna: Antenna | None = None

    @property
    def has_velocity(self) -> bool:
        """True where the fix carries a velocity."""
        return math.isfinite(self.velocity[0])


class MagSample(NamedTuple):
    """Magnetic field (3,) in Gauss, body FRD."""

    time_us: int
    field: Array


class BaroSample(NamedTuple):
    """Pressure altitude in m, up positive."""

    time_us: int
    altitude: float


class VisionSample(NamedTuple):
    """Pose and velocity from an odometry source ("external vision").

    position (3,) m in the odometry's local frame (FRD or NED); quaternion (4,) w, x, y, z body to
    local frame; velocity (3,) m/s in `velocity_frame`; position_var (3,) m^2; velocity_cov (3, 3)
    (m/s)^2; angular_var rad^2. NaN position, quaternion or velocity: not measured.
    `reset_counter` changes when the source says that its frame has jumped.
    """

    time_us: int
    position: Array
    quaternion: Array
    velocity: Array = NAN3
    position_var: Array = UNTOLD_POSITION_VAR
    velocity_cov: Array = UNTOLD_VELOCITY_COV
    angular_var: float = 0.05
    velocity_frame: VelocityFrame = VelocityFrame.LOCAL_FRD
    reset_counter: int = 0

    @property
    def has_position(self) -> bool:
        """True where a horizontal position was measured."""
        return math.isfinite(self.position[0])

    @property
    def has_attitude(self) -> bool:
        """True where an attitude was measured."""
        return math.isfinite(self.quaternion[0])

    @property
    def has_velocity(self) -> bool:
        """True where a horizontal velocity was measured."""
        return math.isfinite(self.velocity[0])


class RangeSample(NamedTuple):
    """Slant distance in m along the sensor axis; quality 0..100, -1 = not known.

    variance m^2, 0 = not known; `ultrasound` tells a sonar from a lidar.
    """

    time_us: int
    distance: float
    quality: int = -1
    min_distance: float = 0.2
    max_distance: float = 20.0
    variance: float = 0.0
    ultrasound: bool = False


class FlowSample(NamedTuple):
    """Optical flow over the `dt` s before `time_us`.

    flow (2,) rad: angle of the scene about body x and y (FRD); without rotation it is
    (+v_right, -v_forward) / height * dt. gyro (3,) rad: minus the rotation of the body, NaN where
    the sensor has no gyro. quality 0..255.
    """

    time_us: int
    flow: Array
    gyro: Array
    quality: int
    dt: float


class AirspeedSample(NamedTuple):
    """True airspeed in m/s and the factor from equivalent to true airspeed."""

    time_us: int
    true_airspeed: float
    eas2tas: float


class AuxVelocitySample(NamedTuple):
    """Velocity (3,) m/s NED against a fixed target and its variance (3,)."""

    time_us: int
    velocity: Array
    variance: Array


class LandedSample(NamedTuple):
    """Ground contact; acts at once. The two vehicle flags come with it."""

    time_us: int
    landed: bool
    fixed_wing: bool = False
    fuse_beta: bool = False


class ArmedSample(NamedTuple):
    """Whether the vehicle is armed; acts at once, on navigation health alone."""

    time_us: int
    armed: bool


class HeadingSample(NamedTuple):
    """Heading of the odometry frame against true north, found from motion.

    yaw rad such that v_ned = Rz(yaw) v_odometry_frd; variance rad^2; `time_us` is the time at
    which it held.
    """

    time_us: int
    yaw: float
    variance: float


class DriftSample(NamedTuple):
    """Random walk of the position of the odometry in m/sqrt(m), at most; inf: not known."""

    time_us: int
    walk: float


Sample = (
    ImuSample | GnssSample | MagSample | BaroSample | VisionSample | RangeSample | FlowSample
    | AirspeedSample | AuxVelocitySample | LandedSample | ArmedSample | HeadingSample
    | DriftSample
)
