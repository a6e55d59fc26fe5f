"""Parameters of the messages' meaning: mounting, frames, noise where a message tells none."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field

from ekf_fusion_ros.params.spec import param

Vector = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)

ODOMETRY_FRAMES = ('auto', 'enu', 'ned', 'frd')
TWIST_FRAMES = ('child', 'parent')
FLOW_AXES = ('auto', 'frd', 'flu')
FLOW_CONVENTIONS = ('ecl', 'mavlink')
AIRSPEED_KINDS = ('equivalent', 'true')
HEADING_OWNERS = ('vehicle', 'antennas')


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryMessageParams:
    """Odometry: its frames, the mounting of its sensor and its noise."""

    frame: str = param(
        'auto', 'Frame that the parent of the odometry must be: enu (any name that does not end '
        'in _ned or _frd), ned (true north) or frd (arbitrary heading); auto takes each name as '
        'it is.', choices=ODOMETRY_FRAMES)
    true_heading: bool = param(
        False, 'The odometry frame is aligned with east and north, not only level; a frame '
        'declared ned is so anyway.')
    twist_frame: str = param(
        'child', 'Axes of the linear velocity: child as REP-105 has it, parent for a source that '
        'gives it along the axes of header.frame_id (VINS-Fusion does); the orientation then '
        'turns it into the body, and without one it counts as not measured.',
        choices=TWIST_FRAMES)
    mount_xyz: Vector = param(
        ZERO, 'Position of the odometry sensor in the body frame (FLU, REP-103).', unit='m')
    mount_rpy: Vector = param(
        ZERO, 'Roll, pitch, yaw about fixed axes that turn sensor axes into body axes (FLU), as '
        'in a URDF.', unit='rad', min=-6.2832, max=6.2832)
    position_noise: float = param(
        0.1, 'Position noise where the covariance is zero, which means unknown.', unit='m',
        min=0.001, max=100, px4='EKF2_EVP_NOISE', live=True)
    velocity_noise: float = param(
        0.1, 'Velocity noise where the covariance is zero, which means unknown.', unit='m/s',
        min=0.001, max=100, px4='EKF2_EVV_NOISE', live=True)
    yaw_noise: float = param(
        0.1, 'Yaw noise where the covariance is zero, which means unknown.', unit='rad',
        min=0.001, max=3.2, px4='EKF2_EVA_NOISE', live=True)
    unmeasured_variance: float = param(
        9e4, 'Variance from which an axis counts as not measured; drivers write 99999 or 1e6.',
        min=1, max=1e12)
    lateral_velocity_noise: float = param(
        0.3, 'Velocity noise of body axes that an odometry of wheels does not measure: the '
        'vehicle is taken to move along the measured ones.', unit='m/s', min=0.01, max=100,
        live=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class FixMessageParams:
    """NavSatFix: the antenna and the meaning of its covariance."""

    mount_xyz: Vector = param(
        ZERO, 'Position of the antenna in the body frame (FLU, REP-103).', unit='m')
    default_eph: float = param(
        1.0, 'Horizontal accuracy of a fix of unknown covariance.', unit='m', min=0.01, max=1000,
        live=True)
    default_epv: float = param(
        4.0, 'Vertical accuracy of a fix of unknown covariance.', unit='m', min=0.01, max=1000,
        live=True)
    min_eph: float = param(
        0.01, 'Smallest horizontal accuracy that is believed.', unit='m', min=1e-4, max=1000,
        live=True)
    min_epv: float = param(
        0.01, 'Smallest vertical accuracy that is believed.', unit='m', min=1e-4, max=1000,
        live=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class FixVelocityMessageParams:
    """Velocity of the receiver."""

    default_accuracy: float = param(
        0.5, 'Speed accuracy where the covariance is zero or absent.', unit='m/s', min=0.01,
        max=100, live=True)
    min_accuracy: float = param(
        0.01, 'Smallest speed accuracy that is believed.', unit='m/s', min=1e-4, max=100,
        live=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuMessageParams:
    """Imu: mounting and limits of a believable reading."""

    mount_xyz: Vector = param(
        ZERO, 'Position of the IMU in the body frame (FLU, REP-103).', unit='m')
    mount_rpy: Vector = param(
        ZERO, 'Roll, pitch, yaw about fixed axes that turn sensor axes into body axes (FLU), as '
        'in a URDF.', unit='rad', min=-6.2832, max=6.2832)
    max_gap: float = param(
        1.0, 'Longest gap between readings that is bridged by interpolation between them.',
        unit='s', min=0.01, max=5)
    max_rate: float = param(
        100.0, 'Largest believable angular rate.', unit='rad/s', min=1, max=1e4)
    max_acceleration: float = param(
        1000.0, 'Largest believable specific force.', unit='m/s^2', min=20, max=1e5)


@dataclass(frozen=True, slots=True, kw_only=True)
class MagneticFieldMessageParams:
    """MagneticField: mounting and limit of a believable reading."""

    mount_rpy: Vector = param(
        ZERO, 'Roll, pitch, yaw about fixed axes that turn sensor axes into body axes (FLU), as '
        'in a URDF.', unit='rad', min=-6.2832, max=6.2832)
    max_field: float = param(
        1e-3, 'Largest believable field; the field of the earth is at most 7e-5 T.', unit='T',
        min=1e-4, max=1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureMessageParams:
    """FluidPressure: limits of a believable reading."""

    min_pressure: float = param(
        1000.0, 'Smallest believable pressure; refuses hPa.', unit='Pa', min=1, max=1e5)
    max_pressure: float = param(
        120000.0, 'Largest believable pressure.', unit='Pa', min=1e5, max=1e7)


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeMessageParams:
    """Range: mounting and limits of the sensor."""

    mount_xyz: Vector = param(
        ZERO, 'Position of the range finder in the body frame (FLU, REP-103).', unit='m')
    min_range: float = param(
        0.0, 'Smallest distance that the sensor measures; 0 = the one of the message.', unit='m',
        min=0, max=1000)
    max_range: float = param(
        0.0, 'Largest distance that the sensor measures; 0 = the one of the message.', unit='m',
        min=0, max=10000)


@dataclass(frozen=True, slots=True, kw_only=True)
class FlowMessageParams:
    """Optical flow as a Vector3Stamped: rates about x and y, quality as z."""

    axes: str = param(
        'auto', 'Axes of the rates; auto is FRD where the frame name holds the word frd, FLU '
        'elsewhere.', choices=FLOW_AXES)
    convention: str = param(
        'ecl', 'Sign of the rates. ecl: in FRD and without rotation x = +v_right / height, '
        'y = -v_forward / height. mavlink: the opposite; a right-hand rotation of the sensor '
        'gives a positive rate (OPTICAL_FLOW_RAD).', choices=FLOW_CONVENTIONS)
    mount_xyz: Vector = param(
        ZERO, 'Position of the flow sensor in the body frame (FLU, REP-103).', unit='m')
    mount_yaw: float = param(
        0.0, 'Angle about z (FLU) that turns sensor axes into body axes.', unit='rad',
        min=-6.2832, max=6.2832)
    max_interval: float = param(
        0.2, 'Longest interval that one message stands for.', unit='s', min=0.005, max=1)
    max_rate: float = param(
        100.0, 'Largest believable rate.', unit='rad/s', min=1, max=1e4)


@dataclass(frozen=True, slots=True, kw_only=True)
class AirspeedMessageParams:
    """Airspeed as linear.x of a twist."""

    kind: str = param(
        'equivalent', 'What linear.x is; equivalent airspeed becomes true airspeed by the '
        'density of the standard atmosphere at the pressure altitude, without a pressure topic '
        'at the altitude of the fix.', choices=AIRSPEED_KINDS)
    temperature_offset: float = param(
        0.0, 'Temperature of the air above that of the standard atmosphere.', unit='K', min=-60,
        max=60)
    max_airspeed: float = param(
        400.0, 'Largest believable airspeed.', unit='m/s', min=10, max=3000)


@dataclass(frozen=True, slots=True, kw_only=True)
class LandedMessageParams:
    """Ground contact as a Bool, and the kind of vehicle that is told with it."""

    fixed_wing: bool = param(False, 'The vehicle flies on wings.')
    fuse_sideslip: bool = param(False, 'Take the sideslip in flight to be zero on average.')


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsHeadingMessageParams:
    """Heading from two antennas."""

    heading_of: str = param(
        'vehicle', 'Whose heading the message tells: that of the vehicle, or that of the axis '
        'through the antennas.', choices=HEADING_OWNERS)
    antenna_yaw: float = param(
        0.0, 'Angle of the axis through the antennas from body forward, counter-clockwise seen '
        'from above (FLU).', unit='rad', min=-6.2832, max=6.2832)
    default_accuracy: float = param(
        0.05, 'Heading accuracy where the covariance is zero or absent.', unit='rad', min=0.001,
        max=3.1)
    min_accuracy: float = param(
        0.001, 'Smallest heading accuracy that is believed.', unit='rad', min=1e-5, max=3.1)


@dataclass(frozen=True, slots=True, kw_only=True)
class AuxVelocityMessageParams:
    """Velocity against a target at rest, as of a landing beacon."""

    default_noise: float = param(
        0.1, 'Velocity noise where the covariance is zero or absent.', unit='m/s', min=0.001,
        max=100)
    min_noise: float = param(
        0.01, 'Smallest velocity noise that is believed.', unit='m/s', min=1e-4, max=100)


@dataclass(frozen=True, slots=True, kw_only=True)
class MessageParams:
    """What the messages of each role mean; the groups bear the names of the roles."""

    odometry: OdometryMessageParams = field(default_factory=OdometryMessageParams)
    fix: FixMessageParams = field(default_factory=FixMessageParams)
    fix_velocity: FixVelocityMessageParams = field(default_factory=FixVelocityMessageParams)
    fix_2: FixMessageParams = field(default_factory=FixMessageParams)
    fix_velocity_2: FixVelocityMessageParams = field(default_factory=FixVelocityMessageParams)
    fix_3: FixMessageParams = field(default_factory=FixMessageParams)
    fix_velocity_3: FixVelocityMessageParams = field(default_factory=FixVelocityMessageParams)
    imu: ImuMessageParams = field(default_factory=ImuMessageParams)
    magnetic_field: MagneticFieldMessageParams = field(
        default_factory=MagneticFieldMessageParams)
    pressure: PressureMessageParams = field(default_factory=PressureMessageParams)
    range: RangeMessageParams = field(default_factory=RangeMessageParams)
    flow: FlowMessageParams = field(default_factory=FlowMessageParams)
    airspeed: AirspeedMessageParams = field(default_factory=AirspeedMessageParams)
    landed: LandedMessageParams = field(default_factory=LandedMessageParams)
    gps_heading: GpsHeadingMessageParams = field(default_factory=GpsHeadingMessageParams)
    aux_velocity: AuxVelocityMessageParams = field(default_factory=AuxVelocityMessageParams)
