"""The numbers an operator looks at, named as in PX4's estimator_status and innovation topics."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping
import math
from typing import TYPE_CHECKING

import numpy as np

from ekf_fusion_ros.ekf2.covariance import quat_by_rotation_vector
from ekf_fusion_ros.ekf2.flags import FLAG_NAMES
from ekf_fusion_ros.ekf2.state import STATES
from ekf_fusion_ros.ekf2.state import WIND

if TYPE_CHECKING:
    from ekf_fusion_ros.ekf2.ekf2 import Ekf2

GPS_CHECKS = {
    'fix': 'gps_fix', 'nsats': 'min_sat_count', 'pdop': 'max_pdop', 'hacc': 'max_horz_err',
    'vacc': 'max_vert_err', 'sacc': 'max_spd_err', 'hdrift': 'max_horz_drift',
    'vdrift': 'max_vert_drift', 'hspeed': 'max_horz_spd_err', 'vspeed': 'max_vert_spd_err'}
FAULTS = {
    'mag_x': 'bad_mag_x', 'mag_y': 'bad_mag_y', 'mag_z': 'bad_mag_z', 'heading': 'bad_hdg',
    'declination': 'bad_mag_decl', 'airspeed': 'bad_airspeed', 'sideslip': 'bad_sideslip',
    'flow_x': 'bad_optflow_x', 'flow_y': 'bad_optflow_y', 'vel_n': 'bad_vel_n',
    'vel_e': 'bad_vel_e', 'vel_d': 'bad_vel_d', 'pos_n': 'bad_pos_n', 'pos_e': 'bad_pos_e',
    'pos_d': 'bad_pos_d', 'accel_bias': 'bad_acc_bias', 'accel_vertical': 'bad_acc_vertical',
    'accel_clipping': 'bad_acc_clipping'}
INNOVATION_CHECKS = {
    'hor_vel': 'reject_hor_vel', 'ver_vel': 'reject_ver_vel', 'hor_pos': 'reject_hor_pos',
    'ver_pos': 'reject_ver_pos', 'mag_x': 'reject_mag_x', 'mag_y': 'reject_mag_y',
    'mag_z': 'reject_mag_z', 'yaw': 'reject_yaw', 'airspeed': 'reject_airspeed',
    'sideslip': 'reject_sideslip', 'hagl': 'reject_hagl', 'flow_x': 'reject_optflow_x',
    'flow_y': 'reject_optflow_y'}
VERDICTS = {None: 'skipped', False: 'pass', True: 'fail'}


def operator_values(ekf: Ekf2) -> dict[str, str]:
    """Return the numbers behind the health of a filter as text, SI units unless named."""
    f = ekf.filter
    return {
        **_uncertainty(ekf),
        'resets': str(ekf.control.resets.counters.total()),
        'horizon_delay': f'{1e-6 * (f.t_now - f.t_horizon):.3f}',
        'control_mode_flags': _set(f.flags, {name: name for name in FLAG_NAMES}),
        'filter_fault_flags': _set(f.faults, FAULTS),
        'innovation_check_flags': _set(f.rejections, INNOVATION_CHECKS),
        **_gps_checks(ekf),
        **_vibration(ekf),
        **_output_tracking(ekf),
        **_terrain(ekf),
        **_wind(ekf),
        **_innovations(ekf),
        **_states(ekf),
    }


def _uncertainty(ekf: Ekf2) -> dict[str, str]:
    p = ekf.filter.cov.p
    to_quat = np.linalg.pinv(quat_by_rotation_vector(ekf.filter.x[0:4]))
    rotation = to_quat @ p[0:4, 0:4] @ to_quat.T
    return {
        'horizontal_position_sigma': f'{_sigma(p[7, 7] + p[8, 8]):.3f}',
        'height_sigma': f'{_sigma(p[9, 9]):.3f}',
        'velocity_sigma': f'{_sigma(np.trace(p[4:7, 4:7])):.3f}',
        'attitude_sigma_deg': f'{math.degrees(_sigma(np.trace(rotation))):.2f}',
        'position_drift': f'{ekf.filter.cov.position_drift:.3f}',
    }


def _gps_checks(ekf: Ekf2) -> dict[str, str]:
    """Return the checks of the last fix: skipped where it does not tell."""
    results = ekf.control.checks.results
    verdicts = {f'gps_check.{word}': VERDICTS[results[name].failed]
                for name, word in GPS_CHECKS.items()}
    details = {f'gps_check_detail.{word}': _measured(ekf, name)
               for name, word in GPS_CHECKS.items() if results[name].failed is not None}
    return verdicts | details


def _measured(ekf: Ekf2, check: str) -> str:
    """Return value and limit of a check, and whether its verdict counts."""
    result = ekf.control.checks.results[check]
    counts = check == 'fix' or getattr(ekf.params.gnss.checks, check)
    words = [] if math.isnan(result.value) else [f'{result.value:.3g}', f'limit {result.limit:g}']
    return ', '.join(words if counts else [*words, 'not selected'])


def _vibration(ekf: Ekf2) -> dict[str, str]:
    """Return coning, high-frequency delta angle (rad) and delta velocity (m/s)."""
    names = ('coning', 'angle', 'velocity')
    return {f'vibration_{name}': f'{metric:.3g}'
            for name, metric in zip(names, ekf.inertial.vibration, strict=True)}


def _output_tracking(ekf: Ekf2) -> dict[str, str]:
    names = ('attitude', 'velocity', 'position')
    return {f'output_{name}_error': f'{error:.4f}'
            for name, error in zip(names, ekf.filter.output.tracking_error, strict=True)}


def _terrain(ekf: Ekf2) -> dict[str, str]:
    terrain = ekf.control.terrain
    return {
        'height_above_ground': f'{terrain.ground_down() - float(ekf.filter.x[9]):.3f}',
        'height_above_ground_sigma': f'{_sigma(terrain.variance):.3f}',
        'height_above_ground_valid': str(terrain.valid).lower(),
    }


def _wind(ekf: Ekf2) -> dict[str, str]:
    """Return speed, where it blows from (clockwise from north) and sigma, while estimated."""
    f = ekf.filter
    if not f.flags.wind:
        return {}
    north, east = f.x[WIND].tolist()
    return {
        'wind_speed': f'{math.hypot(north, east):.2f}',
        'wind_from_deg': f'{math.degrees(math.atan2(-east, -north)) % 360.0:.0f}',
        'wind_sigma': f'{_sigma(np.trace(f.cov.p[WIND, WIND])):.2f}',
    }


def _innovations(ekf: Ekf2) -> dict[str, str]:
    """Return innovation, variance and test ratio of every kind of observation ever tried.

    The ratio is that of the largest innovation to its limit: above 1 it is rejected.
    """
    values = {}
    for aid in ekf.aid_statuses():
        values[f'innovation.{aid.name}'] = _numbers(aid.innovation)
        values[f'innovation_variance.{aid.name}'] = _numbers(aid.innovation_variance)
        values[f'test_ratio.{aid.name}'] = f'{math.sqrt(aid.test_ratio):.3f}'
    return values


def _states(ekf: Ekf2) -> dict[str, str]:
    states, variances = ekf.states(), ekf.variances()
    return ({f'state.{name}': _numbers(states[where]) for name, where in STATES.items()}
            | {f'variance.{name}': _numbers(variances[where]) for name, where in STATES.items()})


def _set(flags: object, words: Mapping[str, str]) -> str:
    """Return the words of the flags that are set."""
    return ', '.join(word for name, word in words.items() if getattr(flags, name)) or 'none'


def _numbers(values: Iterable[float]) -> str:
    return ' '.join(f'{value:.6g}' for value in values)


def _sigma(variance: float) -> float:
    return math.sqrt(max(float(variance), 0.0))
