"""The filter as the outside sees it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ekf_fusion_ros.ekf2.height_source import HEIGHT_WORDS
from ekf_fusion_ros.ekf2.operator_view import operator_values
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.ekf2.state import WIND
from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.kernels.navigation import ACCEL_BIAS
from ekf_fusion_ros.kernels.navigation import ACCELERATION
from ekf_fusion_ros.kernels.navigation import GYRO_BIAS
from ekf_fusion_ros.kernels.navigation import POSE_COVARIANCE
from ekf_fusion_ros.kernels.navigation import POSITION
from ekf_fusion_ros.kernels.navigation import QUATERNION
from ekf_fusion_ros.kernels.navigation import RATE
from ekf_fusion_ros.kernels.navigation import VELOCITY
from ekf_fusion_ros.kernels.navigation import VELOCITY_COVARIANCE
from ekf_fusion_ros.params.ekf2 import ZERO

if TYPE_CHECKING:
    from ekf_fusion_ros.ekf2.ekf2 import Ekf2

REJECTED_US = 3 * SECOND
"""Longer than one wild fix or a short disturbance lasts."""


def nav_state(ekf: Ekf2) -> NavState:
    """Return the output predictor's state at the body origin."""
    f = ekf.filter
    out = f.output
    p = f.cov.p
    row = out.navigation(f.x, p, f.dt_avg)
    velocity, position = row[VELOCITY], row[POSITION]
    if ekf.params.imu.position != ZERO:
        lever = np.asarray(ekf.params.imu.position)
        velocity, position = out.velocity_at_origin(lever), out.position_at_origin(lever)
    pose_cov = row[POSE_COVARIANCE].reshape(6, 6)
    velocity_cov = row[VELOCITY_COVARIANCE].reshape(3, 3)
    if ekf.lapse.ahead:
        ekf.lapse.widen(pose_cov, velocity_cov)
    if f.holding_position and ekf.control.fake_position.aloft:
        ekf.control.fake_position.widen(pose_cov, velocity_cov)
    validity = ekf.control.validity
    terrain = ekf.control.terrain
    wind = f.flags.wind
    return NavState(
        time_us=f.t_now,
        quaternion=row[QUATERNION],
        velocity=velocity,
        position=position,
        angular_rate=row[RATE],
        pose_cov=pose_cov,
        velocity_cov=velocity_cov,
        gyro_bias=row[GYRO_BIAS],
        accel_bias=row[ACCEL_BIAS],
        origin=f.earth.origin,
        yaw_aligned=f.flags.yaw_align,
        dead_reckoning=f.dead_reckoning,
        local_position_valid=validity.local_position,
        global_position_valid=validity.global_position,
        gnss_started=f.observations.gps_hor_pos.starts > 0,
        in_air=f.flags.in_air,
        yaw_jump=ekf.control.resets.counters.yaw_sum,
        acceleration=row[ACCELERATION],
        wind=f.x[WIND].copy() if wind else None,
        wind_cov=p[WIND, WIND].copy() if wind else None,
        ground_down=terrain.ground_down() if terrain.valid else None,
        ground_variance=terrain.variance,
    )


def health(ekf: Ekf2) -> Health:
    """Return the first thing that is not as it should be, or what is being fused."""
    level, text = _state(ekf)
    return Health(level, text, operator_values(ekf))


def _state(ekf: Ekf2) -> tuple[HealthLevel, str]:
    f = ekf.filter
    flags = f.flags
    if not f.t_now:
        return HealthLevel.WARN, 'waiting for inertial data'
    if not ekf.initialised:
        reason = ekf.alignment_obstacle()
        return HealthLevel.WARN, 'gathering samples for the initial alignment' + (
            f': {reason}' if reason else '')
    if not flags.tilt_align:
        return HealthLevel.WARN, 'aligning tilt'
    if not flags.yaw_align:
        return HealthLevel.WARN, 'aligning yaw'
    wants_gnss = ekf.params.gnss.enabled
    if wants_gnss and not f.earth.has_origin:
        failing = ', '.join(ekf.control.checks.blocking())
        reason = f' ({failing} failing)' if failing else ''
        return HealthLevel.WARN, f'waiting for the GNSS checks to pass{reason}'
    if f.dead_reckoning:
        seconds = (f.t_now - f.last_aiding_us) * 1e-6
        since = f'for {seconds:.0f} s' if f.last_aiding_us else 'since the start'
        return HealthLevel.ERROR, f'dead reckoning on inertial data {since}'
    if f.faults.accel_vertical:
        return HealthLevel.WARN, ('the accelerometer contradicts the height sensors: vibration, '
                                  f'or a height source that jumps; {_sources(ekf)}')
    if wants_gnss and not flags.gps:
        return HealthLevel.WARN, _without_gnss(ekf)
    rejected_us = f.t_now - f.times.hor_pos
    if flags.gps and f.fix is not None and f.recent(f.fix.time_us, 2 * SECOND) \
            and rejected_us > REJECTED_US:
        return HealthLevel.WARN, (f'GNSS rejected for {rejected_us * 1e-6:.0f} s, it contradicts '
                                  f'the estimate; {_sources(ekf)}')
    return HealthLevel.OK, f'ok: {_sources(ekf)}'


def _without_gnss(ekf: Ekf2) -> str:
    f = ekf.filter
    last_fused_us = f.observations.gps_hor_pos.last_fused_us
    if not last_fused_us or not (f.flags.ev_pos or f.flags.ev_vel):
        return f'GNSS not used; {_sources(ekf)}'
    return f'dead reckoning on odometry {(f.t_now - last_fused_us) * 1e-6:.0f} s; {_sources(ekf)}'


def _sources(ekf: Ekf2) -> str:
    flags = ekf.filter.flags
    words = (
        (flags.gps, 'GNSS'), (flags.ev_pos, 'odometry position'),
        (flags.ev_vel, 'odometry velocity'), (flags.ev_yaw, 'odometry yaw'),
        (flags.mag_3d, '3-axis magnetometer'), (flags.mag_hdg, 'magnetic heading'),
        (flags.gps_yaw, 'antenna yaw'), (flags.opt_flow, 'optical flow'),
        (flags.fuse_aspd, 'airspeed'),
        *((getattr(flags, name), word) for name, word in HEIGHT_WORDS.items()))
    return 'fusing ' + (', '.join(word for on, word in words if on) or 'nothing')
