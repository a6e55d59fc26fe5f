"""Parameters of the local position estimator (LPE), grouped by sensor."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field

from ekf_fusion_ros.params.spec import param

Vector = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)
ATTITUDE_SOURCES = ('auto', 'imu', 'odometry', 'filter')
VISION_KINDS = ('vision', 'mocap')


@dataclass(frozen=True, slots=True, kw_only=True)
class AttitudeParams:
    """Attitude is an input of LPE: where it comes from, and the filter that stands in for it."""

    source: str = param(
        'auto', 'Where attitude comes from. imu: the orientation of the Imu messages; odometry: '
        'that of the odometry, turned by its heading against north; filter: a complementary '
        'filter of gyro, accelerometer, magnetometer and antenna heading; auto: the first of '
        'these that is there.', choices=ATTITUDE_SOURCES)
    odometry_yaw: bool = param(
        False, 'The heading of the odometry is that of the map: north, or the frame of the '
        'odometry where no fix takes part.')
    yaw_sigma: float = param(
        0.05, 'Noise of the yaw of an Imu orientation or of odometry, as reported.', unit='rad',
        min=0, max=1, live=True)
    tilt_sigma: float = param(
        0.02, 'Noise of roll and pitch, as reported.', unit='rad', min=0, max=1, live=True)
    accel_gain: float = param(
        0.2, 'Gain of the filter from accelerometer to tilt.', unit='1/s', min=0, max=10,
        px4='ATT_W_ACC', live=True)
    yaw_gain: float = param(
        0.1, 'Gain of the filter from magnetometer or antenna heading to yaw.', unit='1/s', min=0,
        max=10, px4='ATT_W_MAG', live=True)
    gyro_bias_gain: float = param(
        0.1, 'Gain of the filter from its corrections to the gyro bias.', unit='1/s', min=0,
        max=1, px4='ATT_W_GYRO_BIAS', live=True)
    gyro_bias_limit: float = param(
        0.05, 'Largest gyro bias of the filter.', unit='rad/s', min=0, max=2, px4='ATT_BIAS_MAX',
        live=True)
    declination_from_table: bool = param(
        True, 'Take the declination from the field table once a fix has come.')
    declination_deg: float = param(
        0.0, 'Declination until then, or where the table is not used.', unit='deg', min=-180,
        max=180, px4='ATT_MAG_DECL')


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessParams:
    """Noise of the process and of its input, and what makes the estimate valid."""

    accel_noise_xy: float = param(
        0.012, 'Horizontal accelerometer noise density.', unit='m/s^2/sqrt(Hz)', min=1e-5, max=2,
        px4='LPE_ACC_XY', live=True)
    accel_noise_z: float = param(
        0.02, 'Vertical accelerometer noise density.', unit='m/s^2/sqrt(Hz)', min=1e-5, max=2,
        px4='LPE_ACC_Z', live=True)
    position_noise: float = param(
        0.1, 'Position process noise density.', unit='m/s/sqrt(Hz)', min=0, max=1,
        px4='LPE_PN_P', live=True)
    velocity_noise: float = param(
        0.1, 'Velocity process noise density: grows with the error of the attitude.',
        unit='m/s^2/sqrt(Hz)', min=0, max=1, px4='LPE_PN_V', live=True)
    bias_noise: float = param(
        1e-3, 'Accelerometer bias process noise density.', unit='m/s^3/sqrt(Hz)', min=0, max=1,
        px4='LPE_PN_B', live=True)
    terrain_noise: float = param(
        1e-3, 'Terrain process noise density at rest.', unit='m/s/sqrt(Hz)', min=0, max=1,
        px4='LPE_PN_T', live=True)
    terrain_grade: float = param(
        1.0, 'Terrain grade: rise over distance that speed adds to that noise.', unit='%', min=0,
        max=100, px4='LPE_T_MAX_GRADE', live=True)
    velocity_sigma_max: float = param(
        0.3, 'Horizontal velocity deviation below which the horizontal estimate becomes valid.',
        unit='m/s', min=0.01, max=1, px4='LPE_VXY_PUB', live=True)
    height_sigma_max: float = param(
        1.0, 'Height deviation below which height and terrain become valid.', unit='m', min=0.3,
        max=5, px4='LPE_Z_PUB', live=True)
    smoothing: float = param(
        5.0, 'Cut-off of the low pass that spreads corrections in what is published; 0 = off.',
        unit='Hz', min=0, max=1000, px4='LPE_X_LP', live=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class BaroParams:
    """Barometric height."""

    enabled: bool = param(True, 'Use barometric height.')
    noise: float = param(3.0, 'Height noise.', unit='m', min=0.01, max=100, px4='LPE_BAR_Z',
                         live=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class GnssParams:
    """GNSS position and velocity."""

    enabled: bool = param(True, 'Use GNSS position and velocity.')
    delay: float = param(
        0.11, 'Delay of the fix against its stamp. PX4 takes 0.29 s from the arrival of the fix.',
        unit='s', min=0, max=0.4, px4='LPE_GPS_DELAY')
    noise_xy: float = param(1.0, 'Lower limit of the horizontal noise.', unit='m', min=0.01,
                            max=5, px4='LPE_GPS_XY', live=True)
    noise_z: float = param(3.0, 'Lower limit of the vertical noise.', unit='m', min=0.01,
                           max=200, px4='LPE_GPS_Z', live=True)
    noise_vxy: float = param(0.25, 'Lower limit of the horizontal velocity noise.', unit='m/s',
                             min=0.01, max=2, px4='LPE_GPS_VXY', live=True)
    noise_vz: float = param(0.25, 'Lower limit of the vertical velocity noise.', unit='m/s',
                            min=0.01, max=2, px4='LPE_GPS_VZ', live=True)
    eph_max: float = param(3.0, 'Largest horizontal accuracy of fixes that start GNSS.', unit='m',
                           min=0.1, max=100, px4='LPE_EPH_MAX', live=True)
    epv_max: float = param(5.0, 'Largest vertical accuracy of fixes that start GNSS.', unit='m',
                           min=0.1, max=1000, px4='LPE_EPV_MAX', live=True)
    position: Vector = param(
        ZERO, 'Antenna position in the body frame (FRD). PX4 takes it to be in the body origin.',
        unit='m')
    projection: str = param('wgs84', 'Ellipsoid, or the sphere of 6371 km that PX4 uses.',
                            choices=('wgs84', 'sphere'))


@dataclass(frozen=True, slots=True, kw_only=True)
class LidarParams:
    """Laser (or infrared) range finder that looks down."""

    noise: float = param(0.03, 'Noise where the sensor tells none.', unit='m', min=0.01, max=1,
                         px4='LPE_LDR_Z', live=True)
    offset: float = param(0.0, 'Place of the sensor below the body origin.', unit='m', min=-1,
                          max=1, px4='LPE_LDR_OFF_Z')


@dataclass(frozen=True, slots=True, kw_only=True)
class SonarParams:
    """Ultrasonic range finder that looks down."""

    noise: float = param(0.05, 'Noise where the sensor tells none.', unit='m', min=0.01, max=1,
                         px4='LPE_SNR_Z', live=True)
    offset: float = param(0.0, 'Place of the sensor below the body origin.', unit='m', min=-1,
                          max=1, px4='LPE_SNR_OFF_Z')


@dataclass(frozen=True, slots=True, kw_only=True)
class FlowParams:
    """Optical flow of a camera that looks down."""

    enabled: bool = param(False, 'Use optical flow for horizontal velocity.')
    gyro_compensation: bool = param(True, 'Take the rotation of the body off the flow.')
    gyro_highpass: float = param(
        0.001, 'Cut-off of the high pass that takes the bias off that rotation.', unit='Hz',
        min=0, max=2, px4='LPE_FGYRO_HP')
    scale: float = param(
        1.0, 'Factor on the angles of the sensor. PX4 has 1.3, for the lens of the PX4FLOW.',
        min=0.1, max=10, px4='LPE_FLW_SCALE', live=True)
    min_quality: int = param(150, 'Lowest quality that is used.', min=0, max=255,
                             px4='LPE_FLW_QMIN', live=True)
    noise_tilt: float = param(7.0, 'Noise per roll and pitch.', unit='m/s/rad', min=0.1, max=10,
                              px4='LPE_FLW_R', live=True)
    noise_rate: float = param(7.0, 'Noise per angular rate.', unit='m/rad', min=0, max=10,
                              px4='LPE_FLW_RR', live=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionParams:
    """Position of an odometry or a motion-capture system whose frame is the local one."""

    enabled: bool = param(False, 'Use the position of the odometry.')
    kind: str = param(
        'vision', 'Which of the two the odometry is: vision has a delay and drops what fails its '
        'fault test, mocap has neither.', choices=VISION_KINDS)
    delay: float = param(0.0, 'Delay of the odometry against its stamp.', unit='s', min=0,
                         max=0.4, px4='LPE_VIS_DELAY')
    noise_xy: float = param(0.1, 'Lower limit of the horizontal noise.', unit='m', min=0.01,
                            max=1, px4='LPE_VIS_XY', live=True)
    noise_z: float = param(0.5, 'Lower limit of the vertical noise.', unit='m', min=0.01,
                           max=100, px4='LPE_VIS_Z', live=True)
    noise_mocap: float = param(0.001, 'Lower limit of the noise of motion capture.', unit='m',
                               min=0.0001, max=1, px4='LPE_VIC_P', live=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class LandParams:
    """Standing on the ground: no horizontal velocity, no height above ground."""

    enabled: bool = param(True, 'Use that a landed vehicle stands on the ground.')
    noise_z: float = param(0.03, 'Noise of the height above ground.', unit='m', min=0.001,
                           max=10, px4='LPE_LAND_Z', live=True)
    noise_vxy: float = param(0.05, 'Noise of the horizontal velocity.', unit='m/s', min=0.01,
                             max=10, px4='LPE_LAND_VXY', live=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class LandingTargetParams:
    """Velocity against a landing target at rest."""

    enabled: bool = param(True, 'Use the velocity against a landing target.')
    min_variance: float = param(
        1e-4, 'Least variance of that velocity.', unit='(m/s)^2', min=0, max=10,
        px4='LPE_LT_COV', live=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class OriginParams:
    """An origin on the earth for a map that no fix places."""

    fake: bool = param(
        False, 'Without fixes, place the origin at `latitude` and `longitude` once the horizontal '
        'estimate is valid.', px4='LPE_FAKE_ORIGIN')
    latitude: float = param(47.397742, 'Latitude of that origin.', unit='deg', min=-90, max=90,
                            px4='LPE_LAT')
    longitude: float = param(8.545594, 'Longitude of that origin.', unit='deg', min=-180,
                             max=180, px4='LPE_LON')


@dataclass(frozen=True, slots=True, kw_only=True)
class LpeParams:
    """The local position estimator of PX4 1.13."""

    attitude: AttitudeParams = field(default_factory=AttitudeParams)
    process: ProcessParams = field(default_factory=ProcessParams)
    baro: BaroParams = field(default_factory=BaroParams)
    gnss: GnssParams = field(default_factory=GnssParams)
    lidar: LidarParams = field(default_factory=LidarParams)
    sonar: SonarParams = field(default_factory=SonarParams)
    flow: FlowParams = field(default_factory=FlowParams)
    vision: VisionParams = field(default_factory=VisionParams)
    land: LandParams = field(default_factory=LandParams)
    landing_target: LandingTargetParams = field(default_factory=LandingTargetParams)
    origin: OriginParams = field(default_factory=OriginParams)
    agl_as_height: bool = param(
        False, 'Give the height above ground in place of the height above the origin.')
