"""Parameters of the EKF2 estimator, grouped by sensor."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field

from ekf_fusion_ros.params.spec import param

Vector = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)

MAG_TYPES = ('auto', 'heading', 'three_axis', 'vtol', 'indoor', 'none')
YAW_HOLDING = ('always', 'unaided', 'never')
BANK_ACCURACIES = ('speed', 'vertical')
HEIGHT_REFERENCES = ('baro', 'gnss', 'range', 'vision')
VEHICLES = ('unspecified', 'multirotor', 'fixed_wing', 'rover')


@dataclass(frozen=True, slots=True, kw_only=True)
class TimingParams:
    """Buffers and the delayed fusion horizon."""

    sensor_interval_min_ms: float = param(
        20.0, 'Shortest interval between samples of one aiding sensor.', unit='ms', min=1,
        max=1000, ecl='sensor_interval_min_ms')
    horizon_min_ms: float = param(
        0.0, 'Shortest delay of the fusion horizon. Raise it when messages arrive later after '
        'their stamp than the largest sensor delay.', unit='ms', min=0, max=2000)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuParams:
    """Inertial input and its biases."""

    gyro_noise: float = param(
        1.5e-2, 'Rate noise for covariance prediction.', unit='rad/s', min=1e-4, max=1.0,
        px4='EKF2_GYR_NOISE', ecl='gyro_noise', live=True)
    accel_noise: float = param(
        0.35, 'Accelerometer noise for covariance prediction.', unit='m/s^2', min=1e-3, max=1.0,
        px4='EKF2_ACC_NOISE', ecl='accel_noise', live=True)
    gyro_bias_process_noise: float = param(
        1e-3, 'Gyro bias random walk.', unit='rad/s^2', min=0, max=1.0,
        px4='EKF2_GYR_B_NOISE', ecl='gyro_bias_p_noise', live=True)
    accel_bias_process_noise: float = param(
        1e-2, 'Accelerometer bias random walk.', unit='m/s^3', min=0, max=1.0,
        px4='EKF2_ACC_B_NOISE', ecl='accel_bias_p_noise', live=True)
    switch_on_gyro_bias: float = param(
        0.1, 'Initial 1-sigma gyro bias.', unit='rad/s', min=0, max=0.5,
        px4='EKF2_GBIAS_INIT', ecl='switch_on_gyro_bias')
    switch_on_accel_bias: float = param(
        0.2, 'Initial 1-sigma accelerometer bias.', unit='m/s^2', min=0, max=1.0,
        px4='EKF2_ABIAS_INIT', ecl='switch_on_accel_bias')
    initial_tilt_err: float = param(
        0.1, 'Initial 1-sigma tilt error.', unit='rad', min=0, max=0.5,
        px4='EKF2_ANGERR_INIT', ecl='initial_tilt_err')
    accel_bias_limit: float = param(
        0.4, 'Largest accelerometer bias.', unit='m/s^2', min=0, max=2.0,
        px4='EKF2_ABL_LIM', ecl='acc_bias_lim')
    accel_bias_learn_accel_limit: float = param(
        25.0, 'Acceleration above which accelerometer biases are not learned.', unit='m/s^2',
        min=1, max=200, px4='EKF2_ABL_ACCLIM', ecl='acc_bias_learn_acc_lim')
    accel_bias_learn_gyro_limit: float = param(
        3.0, 'Rate above which accelerometer biases are not learned.', unit='rad/s', min=0.1,
        max=20, px4='EKF2_ABL_GYRLIM', ecl='acc_bias_learn_gyr_lim')
    accel_bias_learn_time: float = param(
        0.5, 'Decay time of the manoeuvre level that inhibits bias learning.', unit='s',
        min=0.05, max=10, px4='EKF2_ABL_TAU', ecl='acc_bias_learn_tc')
    adapt_accel_noise: bool = param(
        True, 'Raise the accelerometer noise while GNSS velocity shows that it is larger than '
        'stated.')
    doubt_lapses: bool = param(
        True, 'Make attitude, velocity and position uncertain by the time that passes without '
        'inertial data, from 0.5 s on; keep the velocity meanwhile.')
    inhibit_accel_bias: bool = param(False, 'Do not estimate accelerometer biases.')
    moving_scaler: float = param(
        1.0, 'Scale of the thresholds of the at-rest detection.', min=0.1, max=10,
        px4='EKF2_MOVE_TEST', ecl='is_moving_scaler')
    position: Vector = param(
        ZERO, 'IMU position in the body frame (FRD).', unit='m', ecl='imu_pos_body')


@dataclass(frozen=True, slots=True, kw_only=True)
class GnssCheckParams:
    """Receiver quality checks that gate the start of GNSS aiding."""

    nsats: bool = param(True, 'Check the number of satellites.', live=True)
    pdop: bool = param(False, 'Check the position dilution.', live=True)
    hacc: bool = param(True, 'Check the horizontal accuracy.', live=True)
    vacc: bool = param(False, 'Check the vertical accuracy.', live=True)
    sacc: bool = param(True, 'Check the speed accuracy.', live=True)
    hdrift: bool = param(False, 'Check horizontal position drift at rest.', live=True)
    vdrift: bool = param(False, 'Check vertical position drift at rest.', live=True)
    hspeed: bool = param(False, 'Check horizontal speed at rest.', live=True)
    vspeed: bool = param(False, 'Check vertical speed against the filter.', live=True)
    req_hacc: float = param(5.0, 'Largest horizontal accuracy.', unit='m', min=0.1, max=1000,
                            px4='EKF2_REQ_EPH', ecl='req_hacc', live=True)
    req_vacc: float = param(8.0, 'Largest vertical accuracy.', unit='m', min=0.1, max=1000,
                            px4='EKF2_REQ_EPV', ecl='req_vacc', live=True)
    req_sacc: float = param(1.0, 'Largest speed accuracy.', unit='m/s', min=0.05, max=50,
                            px4='EKF2_REQ_SACC', ecl='req_sacc', live=True)
    req_nsats: int = param(6, 'Smallest number of satellites.', min=0, max=60,
                           px4='EKF2_REQ_NSATS', ecl='req_nsats', live=True)
    req_pdop: float = param(2.0, 'Largest position dilution.', min=0.5, max=50,
                            px4='EKF2_REQ_PDOP', ecl='req_pdop', live=True)
    req_hdrift: float = param(0.3, 'Largest horizontal drift speed.', unit='m/s', min=0.01,
                              max=10, px4='EKF2_REQ_HDRIFT', ecl='req_hdrift', live=True)
    req_vdrift: float = param(0.5, 'Largest vertical drift speed.', unit='m/s', min=0.01,
                              max=10, px4='EKF2_REQ_VDRIFT', ecl='req_vdrift', live=True)
    health_time: float = param(10.0, 'Time the checks must pass before the origin is set.',
                               unit='s', min=0, max=60, live=True)
    start_time: float = param(5.0, 'Time without a failed check before aiding starts.',
                              unit='s', min=0, max=60, live=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class GnssParams:
    """GNSS position, velocity and height aiding."""

    enabled: bool = param(True, 'Use GNSS position and velocity.')
    yaw: bool = param(False, 'Use the yaw of a dual-antenna receiver.')
    delay_ms: float = param(110.0, 'Delay of the receiver against the IMU.', unit='ms', min=0,
                            max=1000, px4='EKF2_GPS_DELAY', ecl='gps_delay_ms')
    vel_noise: float = param(0.5, 'Lower limit of the velocity noise.', unit='m/s', min=0.01,
                             max=10, px4='EKF2_GPS_V_NOISE', ecl='gps_vel_noise', live=True)
    pos_noise: float = param(0.5, 'Lower limit of the position noise.', unit='m', min=0.01,
                             max=100, px4='EKF2_GPS_P_NOISE', ecl='gps_pos_noise', live=True)
    vel_gate: float = param(5.0, 'Innovation gate of velocity.', unit='sigma', min=1, max=100,
                            px4='EKF2_GPS_V_GATE', ecl='gps_vel_innov_gate', live=True)
    pos_gate: float = param(5.0, 'Innovation gate of position.', unit='sigma', min=1, max=100,
                            px4='EKF2_GPS_P_GATE', ecl='gps_pos_innov_gate', live=True)
    thorough_yaw_recovery: bool = param(
        True, 'Where velocities prove the yaw to be false, doubt also the gyro bias and the wind '
        'that it has taught, and prefer the yaw of the EKF-GSF bank, once it is certain, to the '
        'course of a fixed wing. Off, as in PX4, both stay.')
    adapt_silence: bool = param(
        True, 'Take a receiver of less than 2.5 Hz to be silent after 2.5 of its intervals, where '
        'other sources go on; off, after a second, whatever its rate.')
    place_early_fixes: bool = param(
        True, 'Give the fixes that wait when the origin is set their place; PX4 takes them to be '
        'at the origin.')
    reset_at_start: bool = param(
        True, 'Jump to the fix whenever aiding starts. Off, a position and velocity that dead '
        'reckoning has kept since the last fix are corrected instead, where the fix passes the '
        'gate.', live=True)
    correlation_time: float = param(
        0.0, 'Correlation time of the position errors. The noise of a fix grows as if fixes '
        'inside twice this time told as much as one; 0 = errors are white.', unit='s', min=0,
        max=300, live=True)
    position: Vector = param(ZERO, 'Antenna position in the body frame (FRD).', unit='m',
                             ecl='gps_pos_body')
    checks: GnssCheckParams = field(default_factory=GnssCheckParams)


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionParams:
    """External vision: odometry from a camera, lidar or wheels."""

    use_position: bool = param(False, 'Fuse horizontal position.')
    use_velocity: bool = param(False, 'Fuse velocity.')
    use_yaw: bool = param(False, 'Fuse yaw; only where the odometry frame is the earth frame.')
    velocity_tells_attitude: bool = param(
        True, 'Observe a velocity that the body carries along (of the body frame, or of a rotated '
        'odometry frame) in the body, so that it corrects attitude; off, it is turned by the '
        'attitude first, and yaw runs away where nothing else measures it.')
    rotate: bool = param(False, 'Rotate the odometry frame into the filter frame.')
    delay_ms: float = param(175.0, 'Delay of the odometry against the IMU.', unit='ms', min=0,
                            max=1000, px4='EKF2_EV_DELAY', ecl='ev_delay_ms')
    pos_gate: float = param(5.0, 'Innovation gate of position.', unit='sigma', min=1, max=100,
                            px4='EKF2_EVP_GATE', ecl='ev_pos_innov_gate', live=True)
    vel_gate: float = param(3.0, 'Innovation gate of velocity.', unit='sigma', min=1, max=100,
                            px4='EKF2_EVV_GATE', ecl='ev_vel_innov_gate', live=True)
    position: Vector = param(ZERO, 'Sensor position in the body frame (FRD).', unit='m',
                             ecl='ev_pos_body')


@dataclass(frozen=True, slots=True, kw_only=True)
class MagParams:
    """Magnetometer."""

    type: str = param(
        'auto', 'How the magnetometer is used. auto: heading on the ground and in steady flight, '
        'three axes in flight where motion makes them observable; heading or three_axis: always '
        'this; vtol: as auto, but while airspeed is fused only the field states are corrected; '
        'indoor: as auto, but only while fixes or odometry aid; none: never.', choices=MAG_TYPES)
    delay_ms: float = param(0.0, 'Delay against the IMU.', unit='ms', min=0, max=300,
                            px4='EKF2_MAG_DELAY', ecl='mag_delay_ms')
    heading_noise: float = param(0.3, 'Noise of the magnetic heading.', unit='rad', min=0.01,
                                 max=1.0, px4='EKF2_HEAD_NOISE', ecl='mag_heading_noise',
                                 live=True)
    noise: float = param(0.05, 'Noise of one axis.', unit='G', min=0.001, max=1.0,
                         px4='EKF2_MAG_NOISE', ecl='mag_noise', live=True)
    heading_gate: float = param(2.6, 'Innovation gate of heading.', unit='sigma', min=1, max=100,
                                px4='EKF2_HDG_GATE', ecl='heading_innov_gate', live=True)
    gate: float = param(3.0, 'Innovation gate of the three axes.', unit='sigma', min=1, max=100,
                        px4='EKF2_MAG_GATE', ecl='mag_innov_gate', live=True)
    earth_process_noise: float = param(1e-3, 'Earth field random walk.', unit='G/s', min=0,
                                       max=0.1, px4='EKF2_MAG_E_NOISE', ecl='mage_p_noise',
                                       live=True)
    body_process_noise: float = param(1e-4, 'Body field random walk.', unit='G/s', min=0,
                                      max=0.1, px4='EKF2_MAG_B_NOISE', ecl='magb_p_noise',
                                      live=True)
    declination_deg: float = param(0.0, 'Declination where the field table is not used.',
                                   unit='deg', min=-180, max=180, px4='EKF2_MAG_DECL',
                                   ecl='mag_declination_deg')
    declination_from_table: bool = param(True, 'Take the declination from the field model.')
    declination_always: bool = param(True, 'Fuse the declination also while GNSS is used.')
    acceleration_gate: float = param(0.5, 'Horizontal acceleration that makes yaw observable.',
                                     unit='m/s^2', min=0, max=5, px4='EKF2_MAG_ACCLIM',
                                     ecl='mag_acc_gate', live=True)
    yaw_rate_gate: float = param(0.25, 'Yaw rate that makes the body field observable.',
                                 unit='rad/s', min=0, max=5, px4='EKF2_MAG_YAWLIM',
                                 ecl='mag_yaw_rate_gate', live=True)
    synthesize_z: bool = param(False, 'Replace the z axis by the one the field table gives.')
    check_strength: bool = param(False, 'Do not use a field of implausible strength.', live=True)
    strength_tolerance: float = param(
        0.2, 'Plausible deviation of the strength from that of the field model.', unit='G',
        min=0.01, max=1.0, px4='EKF2_MAG_CHK_STR', live=True)
    check_inclination: bool = param(
        False, 'Do not use a field of implausible inclination at the attitude of the filter.',
        live=True)
    inclination_tolerance: float = param(
        20.0, 'Plausible deviation of the inclination from that of the field model.', unit='deg',
        min=0, max=90, px4='EKF2_MAG_CHK_INC', live=True)
    field_model: str = param('ecl_table', 'Source of declination, inclination and strength.',
                             choices=('ecl_table', 'wmm'))


@dataclass(frozen=True, slots=True, kw_only=True)
class BaroParams:
    """Barometric height."""

    delay_ms: float = param(0.0, 'Delay against the IMU.', unit='ms', min=0, max=300,
                            px4='EKF2_BARO_DELAY', ecl='baro_delay_ms')
    noise: float = param(2.0, 'Height noise.', unit='m', min=0.01, max=15,
                         px4='EKF2_BARO_NOISE', ecl='baro_noise', live=True)
    gate: float = param(5.0, 'Innovation gate of barometric and GNSS height.', unit='sigma',
                        min=1, max=100, px4='EKF2_BARO_GATE', ecl='baro_innov_gate', live=True)
    pressure_error_forward: float = param(
        0.0, 'Static pressure error over dynamic pressure of the airflow from ahead.', min=-2,
        max=2, px4='EKF2_PCOEF_XP', ecl='static_pressure_coef_xp')
    pressure_error_backward: float = param(
        0.0, 'The same for the airflow from behind.', min=-2, max=2, px4='EKF2_PCOEF_XN',
        ecl='static_pressure_coef_xn')
    pressure_error_right: float = param(
        0.0, 'The same for the airflow from the right.', min=-2, max=2, px4='EKF2_PCOEF_YP',
        ecl='static_pressure_coef_yp')
    pressure_error_left: float = param(
        0.0, 'The same for the airflow from the left.', min=-2, max=2, px4='EKF2_PCOEF_YN',
        ecl='static_pressure_coef_yn')
    pressure_error_vertical: float = param(
        0.0, 'The same for the airflow from above or below.', min=-2, max=2,
        px4='EKF2_PCOEF_Z', ecl='static_pressure_coef_z')
    pressure_error_max_airspeed: float = param(
        20.0, 'Airspeed along an axis from which the correction grows no more.', unit='m/s',
        min=0, max=100, px4='EKF2_ASPD_MAX', ecl='max_correction_airspeed')


@dataclass(frozen=True, slots=True, kw_only=True)
class HeightParams:
    """Which sensor is the height reference."""

    reference: str = param('baro', 'Primary height source.', choices=HEIGHT_REFERENCES)
    wait_for_baro: bool = param(
        False, 'Do not start without barometric height, whatever the reference is.')
    gnss_absolute: bool = param(
        False, 'Let GNSS height as the reference be the altitude of the fixes. PX4 ties it to the '
        'height it finds at the start instead, so that the error of one fix stays for good.')


@dataclass(frozen=True, slots=True, kw_only=True)
class EarthParams:
    """Shape of the earth."""

    projection: str = param('wgs84', 'Ellipsoid, or the sphere of 6371 km that PX4 uses.',
                            choices=('wgs84', 'sphere'))


@dataclass(frozen=True, slots=True, kw_only=True)
class TerrainParams:
    """Height of the ground under the vehicle."""

    process_noise: float = param(5.0, 'Terrain height random walk.', unit='m/s', min=0, max=50,
                                 px4='EKF2_TERR_NOISE', ecl='terrain_p_noise')
    gradient: float = param(0.5, 'Terrain gradient.', unit='m/m', min=0, max=10,
                            px4='EKF2_TERR_GRAD', ecl='terrain_gradient')
    ground_clearance: float = param(0.1, 'Height of the body origin above ground at rest.',
                                    unit='m', min=0.01, max=10, px4='EKF2_MIN_RNG',
                                    ecl='rng_gnd_clearance')
    use_range: bool = param(True, 'Estimate terrain height from the range finder.')
    use_flow: bool = param(True, 'Estimate terrain height from optical flow and GNSS velocity '
                           'while the range finder is silent.')


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeParams:
    """Range finder: height above ground along a body axis."""

    delay_ms: float = param(5.0, 'Delay against the IMU.', unit='ms', min=0, max=300,
                            px4='EKF2_RNG_DELAY', ecl='range_delay_ms')
    noise: float = param(0.1, 'Range noise.', unit='m', min=0.01, max=10, px4='EKF2_RNG_NOISE',
                         ecl='range_noise', live=True)
    noise_by_range: float = param(0.0, 'Growth of the noise with range.', unit='m/m', min=0,
                                  max=0.2, px4='EKF2_RNG_SFE', ecl='range_noise_scaler', live=True)
    gate: float = param(5.0, 'Innovation gate of range height and terrain.', unit='sigma', min=1,
                        max=100, px4='EKF2_RNG_GATE', ecl='range_innov_gate', live=True)
    pitch: float = param(0.0, 'Pitch of the sensor axis against body down, nose up positive.',
                         unit='rad', min=-0.75, max=0.75, px4='EKF2_RNG_PITCH',
                         ecl='rng_sens_pitch')
    min_cos_tilt: float = param(0.7071, 'Cosine of the tilt of the sensor axis beyond which '
                                'range (and optical flow) are not used.', min=0.0, max=1.0,
                                ecl='range_cos_max_tilt', live=True)
    good_quality_time: float = param(1.0, 'Time without bad quality before range is used again.',
                                     unit='s', min=0.1, max=5, px4='EKF2_RNG_QLTY_T',
                                     ecl='range_valid_quality_s')
    aid: bool = param(False, 'Take height from the range finder near the ground at low speed, '
                      'whatever the height reference is.')
    aid_max_height: float = param(5.0, 'Height above ground up to which range aid acts.',
                                  unit='m', min=0.1, max=100, px4='EKF2_RNG_A_HMAX',
                                  ecl='max_hagl_for_range_aid', live=True)
    aid_max_speed: float = param(1.0, 'Horizontal speed up to which range aid acts.', unit='m/s',
                                 min=0.1, max=20, px4='EKF2_RNG_A_VMAX',
                                 ecl='max_vel_for_range_aid', live=True)
    aid_gate: float = param(1.0, 'Terrain innovation up to which range aid acts.', unit='sigma',
                            min=0.1, max=5, px4='EKF2_RNG_A_IGATE', ecl='range_aid_innov_gate',
                            live=True)
    position: Vector = param(ZERO, 'Sensor position in the body frame (FRD).', unit='m',
                             ecl='rng_pos_body')


@dataclass(frozen=True, slots=True, kw_only=True)
class FlowParams:
    """Optical flow: angular rate of the ground seen by a camera along body down."""

    enabled: bool = param(False, 'Use optical flow for horizontal velocity.')
    delay_ms: float = param(5.0, 'Delay against the IMU, to the end of the exposure.', unit='ms',
                            min=0, max=300, px4='EKF2_OF_DELAY', ecl='flow_delay_ms')
    noise: float = param(0.15, 'Noise at the best quality, at least 0.05.', unit='rad/s',
                         min=0.01, max=10,
                         px4='EKF2_OF_N_MIN', ecl='flow_noise', live=True)
    noise_at_min_quality: float = param(0.5, 'Noise at the lowest quality that is used.',
                                        unit='rad/s', min=0.01, max=10, px4='EKF2_OF_N_MAX',
                                        ecl='flow_noise_qual_min', live=True)
    min_quality: int = param(1, 'Lowest quality that is used.', min=0, max=255,
                             px4='EKF2_OF_QMIN', ecl='flow_qual_min', live=True)
    gate: float = param(3.0, 'Innovation gate.', unit='sigma', min=1, max=100,
                        px4='EKF2_OF_GATE', ecl='flow_innov_gate', live=True)
    max_rate: float = param(2.5, 'Largest rate that the sensor can follow.', unit='rad/s', min=0,
                            max=100, live=True)
    opposed_gyro: bool = param(
        True, 'Learn the bias of a gyro in the sensor from its sum with the rotation of the '
        'vehicle, as it gives minus the rotation; off, from their difference as in PX4, which '
        'takes rotation for bias.')
    position: Vector = param(ZERO, 'Sensor position in the body frame (FRD).', unit='m',
                             ecl='flow_pos_body')


@dataclass(frozen=True, slots=True, kw_only=True)
class AirDataParams:
    """Airspeed, zero sideslip and drag: what tells the wind."""

    airspeed_noise: float = param(1.4, 'Noise of equivalent airspeed, taken to be 0.5 to 5.',
                                  unit='m/s', min=0.1, max=20, px4='EKF2_EAS_NOISE',
                                  ecl='eas_noise', live=True)
    airspeed_gate: float = param(5.0, 'Innovation gate of airspeed.', unit='sigma', min=1,
                                 max=100, px4='EKF2_TAS_GATE', ecl='tas_innov_gate', live=True)
    use_sideslip: bool = param(
        True, 'Take the sideslip of fixed wings in flight to be zero on average.')
    sideslip_noise: float = param(0.3, 'Noise of the assumption of zero sideslip.', unit='rad',
                                  min=0.01, max=1.0, px4='EKF2_BETA_NOISE', ecl='beta_noise',
                                  live=True)
    sideslip_gate: float = param(5.0, 'Innovation gate of sideslip.', unit='sigma', min=1,
                                 max=100, px4='EKF2_BETA_GATE', ecl='beta_innov_gate', live=True)
    use_drag: bool = param(False, 'Estimate wind from the drag of a multirotor.')
    drag_noise: float = param(2.5, 'Variance of the drag model, at least 0.5.',
                              unit='(m/s^2)^2', min=0.01, max=100, px4='EKF2_DRAG_NOISE',
                              ecl='drag_noise', live=True)
    ballistic_coef_x: float = param(
        100.0, 'Mass over drag area of the airflow along x; up to 1 = no such drag.',
        unit='kg/m^2', min=0, max=200, px4='EKF2_BCOEF_X', ecl='bcoef_x', live=True)
    ballistic_coef_y: float = param(
        100.0, 'Mass over drag area of the airflow along y; up to 1 = no such drag.',
        unit='kg/m^2', min=0, max=200, px4='EKF2_BCOEF_Y', ecl='bcoef_y', live=True)
    momentum_drag_coef: float = param(
        0.1, 'Drag of the propellers per airspeed across their axis; up to 0.001 = none.',
        unit='1/s', min=0, max=1.0, px4='EKF2_MCOEF', ecl='mcoef', live=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class AidingParams:
    """Limits of aiding and of its absence."""

    pos_noaid_noise: float = param(10.0, 'Position noise without horizontal aiding.', unit='m',
                                   min=0.5, max=100, px4='EKF2_NOAID_NOISE',
                                   ecl='pos_noaid_noise', live=True)
    valid_timeout: float = param(5.0, 'Dead reckoning after which the output is not valid.',
                                 unit='s', min=0.5, max=600, px4='EKF2_NOAID_TOUT')
    vehicle: str = param(
        'unspecified', 'Kind of vehicle. On fixed wings sideslip in flight is taken to be zero on '
        'average; a rover is never on the ground while it moves, whatever a landed sample says; '
        'airspeed of a multirotor is not used.', choices=VEHICLES)
    infer_in_air: bool = param(
        True, 'Take a moving vehicle to be in the air, one at rest to be on the ground, until a '
        'landed sample says which; do not take an even motion for rest.')
    reset_timeout: float = param(7.0, 'Time without accepted aiding before a reset.', unit='s',
                                 min=1, max=60, live=True)
    position_drift: float = param(
        0.0, 'Random walk of the horizontal position by distance travelled (by time above 1 m/s), '
        'for inertial input whose velocity is wrong for long (scale, slip).', unit='m/sqrt(m)',
        min=0, max=10, live=True)
    yaw_drift: float = param(
        0.0, 'Random walk of yaw beside the gyro noise.', unit='rad/sqrt(s)', min=0, max=1,
        live=True)
    hold_yaw: str = param(
        'unaided', 'Bound the yaw variance by a pseudo measurement while nothing measures yaw: '
        'always; while GNSS in flight does not tell it either (unaided); never.',
        choices=YAW_HOLDING)
    doubt_held_position: bool = param(
        True, 'After the last position was held for want of aiding, a velocity that returns takes '
        'up there, as uncertain as the time in the air has made it; off, it takes up as certain '
        'as it was held, and flow on the ground at the origin.')
    airspeed_delay_ms: float = param(100.0, 'Delay of the airspeed sensor.', unit='ms', min=0,
                                     max=300, px4='EKF2_ASP_DELAY', ecl='airspeed_delay_ms')
    airspeed_threshold: float = param(2.0, 'Airspeed above which it is used; 0 = never.',
                                      unit='m/s', min=0, max=50, px4='EKF2_ARSP_THR',
                                      ecl='arsp_thr')
    airspeed_conditions: bool = param(
        True, 'Keep airspeed from the filter that is below the threshold or of a multirotor.')
    auxvel_delay_ms: float = param(5.0, 'Delay of the auxiliary velocity.', unit='ms', min=0,
                                   max=300, px4='EKF2_AVEL_DELAY', ecl='auxvel_delay_ms')
    wind_process_noise: float = param(0.1, 'Wind random walk.', unit='m/s^2', min=0, max=1.0,
                                      px4='EKF2_WIND_NOISE', ecl='wind_vel_p_noise', live=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputParams:
    """Output predictor from the fusion horizon to now."""

    vel_tau: float = param(0.25, 'Velocity tracking time constant.', unit='s', min=0.02, max=10,
                           px4='EKF2_TAU_VEL', ecl='vel_Tau')
    pos_tau: float = param(0.25, 'Position tracking time constant.', unit='s', min=0.02, max=10,
                           px4='EKF2_TAU_POS', ecl='pos_Tau')


@dataclass(frozen=True, slots=True, kw_only=True)
class YawEstimatorParams:
    """EKF-GSF bank of yaw hypotheses."""

    default_airspeed: float = param(15.0, 'Fixed-wing airspeed where none is measured.',
                                    unit='m/s', min=0, max=100, px4='EKF2_GSF_TAS',
                                    ecl='EKFGSF_tas_default')
    accuracy: str = param(
        'speed', 'What tells how good the velocity of a fix is: its own accuracy, at least '
        '1.2 m/s (speed), or as in PX4 that of its height, m taken for m/s (vertical).',
        choices=BANK_ACCURACIES)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ekf2Params:
    """Everything the EKF2 estimator can be told."""

    timing: TimingParams = field(default_factory=TimingParams)
    imu: ImuParams = field(default_factory=ImuParams)
    gnss: GnssParams = field(default_factory=GnssParams)
    vision: VisionParams = field(default_factory=VisionParams)
    mag: MagParams = field(default_factory=MagParams)
    baro: BaroParams = field(default_factory=BaroParams)
    height: HeightParams = field(default_factory=HeightParams)
    earth: EarthParams = field(default_factory=EarthParams)
    terrain: TerrainParams = field(default_factory=TerrainParams)
    range: RangeParams = field(default_factory=RangeParams)
    flow: FlowParams = field(default_factory=FlowParams)
    air_data: AirDataParams = field(default_factory=AirDataParams)
    aiding: AidingParams = field(default_factory=AidingParams)
    output: OutputParams = field(default_factory=OutputParams)
    yaw_estimator: YawEstimatorParams = field(default_factory=YawEstimatorParams)
