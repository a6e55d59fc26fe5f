"""Parameters of the messages' meaning: mounting, frames, noise where a message tells none."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field

from ekf_fusion_ros.params.spec import param

Vector = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)

ODOMETRY_FRAMES = ('auto', 'enu', 'ned', 'frd')


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
    mount_xyz: Vector = param(
        ZERO, 'Position of the odometry sensor in the body frame (FLU, REP-103).', unit='m')
    mount_rpy: Vector = param(
        ZERO, 'Roll, pitch, yaw about fixed axes that turn sensor axes into body axes (FLU), as '
        'in a URDF.', unit='rad', min=-6.2832, max=6.2832)
    position_noise: float = param(
        0.1, 'Position noise where the covariance is zero, which means unknown.', unit='m',
        min=0.001, max=100, px4='EKF2_EVP_NOISE')
    velocity_noise: float = param(
        0.1, 'Velocity noise where the covariance is zero, which means unknown.', unit='m/s',
        min=0.001, max=100, px4='EKF2_EVV_NOISE')
    yaw_noise: float = param(
        0.1, 'Yaw noise where the covariance is zero, which means unknown.', unit='rad',
        min=0.001, max=3.2, px4='EKF2_EVA_NOISE')
    unmeasured_variance: float = param(
        9e4, 'Variance from which an axis counts as not measured; drivers write 99999 or 1e6.',
        min=1, max=1e12)
    lateral_velocity_noise: float = param(
        0.3, 'Velocity noise of body axes that an odometry of wheels does not measure: the '
        'vehicle is taken to move along the measured ones.', unit='m/s', min=0.01, max=100)


@dataclass(frozen=True, slots=True, kw_only=True)
class FixMessageParams:
    """NavSatFix: the antenna and the meaning of its covariance."""

    mount_xyz: Vector = param(
        ZERO, 'Position of the antenna in the body frame (FLU, REP-103).', unit='m')
    default_eph: float = param(
        1.0, 'Horizontal accuracy of a fix of unknown covariance.', unit='m', min=0.01, max=1000)
    default_epv: float = param(
        4.0, 'Vertical accuracy of a fix of unknown covariance.', unit='m', min=0.01, max=1000)
    min_eph: float = param(
        0.01, 'Smallest horizontal accuracy that is believed.', unit='m', min=1e-4, max=1000)
    min_epv: float = param(
        0.01, 'Smallest vertical accuracy that is believed.', unit='m', min=1e-4, max=1000)


@dataclass(frozen=True, slots=True, kw_only=True)
class FixVelocityMessageParams:
    """Velocity of the receiver."""

    default_accuracy: float = param(
        0.5, 'Speed accuracy where the covariance is zero or absent.', unit='m/s', min=0.01,
        max=100)
    min_accuracy: float = param(
        0.01, 'Smallest speed accuracy that is believed.', unit='m/s', min=1e-4, max=100)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuMessageParams:
    """Imu: mounting and limits of a believable reading."""

    mount_xyz: Vector = param(
        ZERO, 'Position of the IMU in the body frame (FLU, REP-103).', unit='m')
    mount_rpy: Vector = param(
        ZERO, 'Roll, pitch, yaw about fixed axes that turn sensor axes into body axes (FLU), as '
        'in a URDF.', unit='rad', min=-6.2832, max=6.2832)
    max_gap: float = param(
        0.2, 'Gap between readings above which it is not filled with the newest reading.',
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
class MessageParams:
    """What the messages of each role mean; the groups bear the names of the roles."""

    odometry: OdometryMessageParams = field(default_factory=OdometryMessageParams)
    fix: FixMessageParams = field(default_factory=FixMessageParams)
    fix_velocity: FixVelocityMessageParams = field(default_factory=FixVelocityMessageParams)
    imu: ImuMessageParams = field(default_factory=ImuMessageParams)
    magnetic_field: MagneticFieldMessageParams = field(
        default_factory=MagneticFieldMessageParams)
    pressure: PressureMessageParams = field(default_factory=PressureMessageParams)
