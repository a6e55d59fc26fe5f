"""What each role brings, and the aiding that a set of roles calls for."""

from __future__ import annotations

from collections.abc import Collection
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING
from typing import Any
from typing import TypeVar

from ekf_fusion_ros.buffer import MAX_AGE_US
from ekf_fusion_ros.messages.decode_odometry import has_true_heading
from ekf_fusion_ros.messages.mounting import with_mounting

if TYPE_CHECKING:
    from ekf_fusion_ros.params.ekf2 import Ekf2Params
    from ekf_fusion_ros.params.lpe import LpeParams
    from ekf_fusion_ros.params.tree import Params

ODOMETRY = 'odometry'
FIX = 'fix'
FIX_VELOCITY = 'fix_velocity'
IMU = 'imu'
MAGNETIC_FIELD = 'magnetic_field'
PRESSURE = 'pressure'
RANGE = 'range'
FLOW = 'flow'
AIRSPEED = 'airspeed'
LANDED = 'landed'
GPS_HEADING = 'gps_heading'
AUX_VELOCITY = 'aux_velocity'
ARMED = 'armed'
FIX_2 = 'fix_2'
FIX_VELOCITY_2 = 'fix_velocity_2'
FIX_3 = 'fix_3'
FIX_VELOCITY_3 = 'fix_velocity_3'

SUPPORTED = (
    ODOMETRY, FIX, FIX_VELOCITY, IMU, MAGNETIC_FIELD, PRESSURE, RANGE, FLOW, AIRSPEED, LANDED,
    GPS_HEADING, AUX_VELOCITY, ARMED, FIX_2, FIX_VELOCITY_2, FIX_3, FIX_VELOCITY_3)
WITHOUT_STAMP = (LANDED, ARMED)
"""Roles whose messages act when they come."""

FIXES = (FIX, FIX_2, FIX_3)
"""One role for each receiver; the first leads where one must: its delay, its fix at the start."""

FIX_OF_PART = {FIX_VELOCITY: FIX, GPS_HEADING: FIX, FIX_VELOCITY_2: FIX_2, FIX_VELOCITY_3: FIX_3}
"""Roles whose messages belong to the fix of the same stamp, and the role of that fix."""

PARTS_OF_FIX = tuple(FIX_OF_PART)

NEEDED = {**dict.fromkeys(FIXES[1:], FIX), **FIX_OF_PART}
"""Roles that need another beside them, and which."""

# Where ekf2 keeps the delay of a role.
DELAYS = {
    FIX: ('gnss', 'delay_ms'),
    MAGNETIC_FIELD: ('mag', 'delay_ms'),
    PRESSURE: ('baro', 'delay_ms'),
    ODOMETRY: ('vision', 'delay_ms'),
    RANGE: ('range', 'delay_ms'),
    FLOW: ('flow', 'delay_ms'),
    AIRSPEED: ('aiding', 'airspeed_delay_ms'),
    AUX_VELOCITY: ('aiding', 'auxvel_delay_ms'),
}


Tree = TypeVar('Tree', 'Ekf2Params', 'LpeParams')


def check_roles(roles: Collection[str]) -> None:
    """Raise ValueError for a set of roles that cannot be fused."""
    for role in roles:
        if role not in SUPPORTED:
            raise ValueError(f'unknown role {role!r}: choose of {", ".join(SUPPORTED)}')
    if IMU not in roles and ODOMETRY not in roles:
        raise ValueError('no inertial input: give an odometry or an imu topic')
    for role, fix in NEEDED.items():
        if role in roles and fix not in roles:
            raise ValueError(f'role {role} needs a {fix} topic beside it')


def configure(params: Params, roles: Collection[str]) -> Params:
    """Return the parameters in effect for these roles.

    Only values of `params.ekf2` and `params.lpe` that stand at their default are changed, so that
    a value chosen by the user wins. What the estimator has no parameter for is not asked of it.
    """
    check_roles(roles)
    params = replace(params, ekf2=with_mounting(params.ekf2, params.messages))
    if not params.session.automatic_aiding:
        return params
    return replace(params, ekf2=_with_wanted(params.ekf2, _wanted(params, roles)),
                   lpe=_with_wanted(params.lpe, _wanted_of_lpe(params, roles)))


def _with_wanted(tree: Tree, by_group: Mapping[str, Mapping[str, Any]]) -> Tree:
    """Return parameters of an estimator with wanted values where they stand at their default."""
    for group, wanted in by_group.items():
        current = getattr(tree, group, None)
        if current is None:
            continue
        default = type(current)()
        changes = {name: value for name, value in wanted.items() if hasattr(current, name)
                   and getattr(current, name) == getattr(default, name)}
        tree = replace(tree, **{group: replace(current, **changes)})
    return tree


def _wanted(params: Params, roles: Collection[str]) -> dict[str, dict[str, Any]]:
    """Return the values these roles call for, by group of ekf2."""
    has_fix = FIX in roles
    wanted: dict[str, dict[str, Any]] = {
        'timing': {'horizon_min_ms': _horizon_ms(params, roles)},
        'gnss': {'enabled': has_fix},
    }
    if PRESSURE not in roles:
        wanted['height'] = {
            'reference': _height_without_pressure(roles), 'gnss_absolute': has_fix}
    if MAGNETIC_FIELD not in roles:
        wanted['mag'] = {'type': 'none'}
    if ODOMETRY in roles:
        # Its own heading is arbitrary unless it is declared; alone, its frame is the map.
        own_frame = not has_fix or has_true_heading(params.messages.odometry)
        wanted['vision'] = {
            'use_velocity': True,
            'use_position': not has_fix,
            'use_yaw': own_frame,
            'rotate': not own_frame,
            'delay_ms': params.session.odometry_delay_ms,
        }
    if GPS_HEADING in roles:
        wanted['gnss']['yaw'] = True
    if FLOW in roles:
        wanted['flow'] = {'enabled': True}
    if IMU not in roles:
        _add_odometry_as_imu(wanted)
    elif ODOMETRY in roles and has_fix:
        _add_odometry_beside_imu(wanted)
    return wanted


def _wanted_of_lpe(params: Params, roles: Collection[str]) -> dict[str, dict[str, Any]]:
    """Return the values of lpe that these roles call for."""
    own_frame = FIX not in roles or has_true_heading(params.messages.odometry)
    x, y, z = params.messages.fix.mount_xyz
    wanted: dict[str, dict[str, Any]] = {
        'gnss': {'enabled': FIX in roles, 'position': (x, -y, -z)},
        'flow': {'enabled': FLOW in roles}}
    if ODOMETRY in roles:
        wanted['attitude'] = {'odometry_yaw': own_frame}
        wanted['vision'] = {
            'enabled': FIX not in roles, 'delay': 1e-3 * params.session.odometry_delay_ms}
    return wanted


def _height_without_pressure(roles: Collection[str]) -> str:
    if FIX in roles:
        return 'gnss'
    return 'vision' if ODOMETRY in roles or RANGE not in roles else 'range'


def _add_odometry_as_imu(wanted: dict[str, dict[str, Any]]) -> None:
    """Add the noise of increments that come from odometry.

    They have no accelerometer bias and hardly a gyro bias, but drift in yaw, scale and slip, and
    nothing else shows the slip while it lasts.
    """
    wanted['imu'] = {
        'inhibit_accel_bias': True,
        'gyro_noise': 0.005,
        'switch_on_gyro_bias': 0.001,
        'gyro_bias_process_noise': 1e-5,
    }
    wanted['aiding'] = {'position_drift': 1.4, 'yaw_drift': 0.005, 'hold_yaw': 'never'}
    wanted['gnss'].update(correlation_time=3.0, reset_at_start=False)


def _add_odometry_beside_imu(wanted: dict[str, dict[str, Any]]) -> None:
    """Add what neither odometry nor fixes say of their errors: that these last.

    The velocity of odometry is wrong for long by scale and slip, fixes err by metres over tens of
    seconds. Taken for white noise, the one makes position certain and the other passes for news.
    """
    wanted['aiding'] = {'position_drift': 0.7}
    wanted['gnss'].update(correlation_time=1.0, reset_at_start=False)


def age_limit_us(params: Params, role: str) -> int:
    """Return the age in us above which the filter could not fuse a sample of a role any more.

    The horizon takes a sample up to MAX_AGE_US after it has passed it; holding takes its share.
    """
    ekf2, session = params.ekf2, params.session
    if role in PARTS_OF_FIX:
        # it goes with its fix, and pairing tells which come too late for that
        return round(1e6 * session.stamp_age_max)
    delays = {**_delays_ms(params), **_further_delays_ms(params, (role,))}
    horizon_ms = max(ekf2.timing.horizon_min_ms, *delays.values())
    usable_ms = horizon_ms - delays.get(role, 0.0) - session.hold_ms
    return min(round(1e6 * session.stamp_age_max), round(1e3 * usable_ms) + MAX_AGE_US)


def _horizon_ms(params: Params, roles: Collection[str]) -> float:
    """Return a horizon behind every delay in use and the hold of the session."""
    session = params.session
    delays = {**_delays_ms(params), **_further_delays_ms(params, roles),
              ODOMETRY: session.odometry_delay_ms}
    return max(session.horizon_ms, max(delays.values()) + 2.0 * session.hold_ms)


def _delays_ms(params: Params) -> dict[str, float]:
    """Return the delays by role, of those that the estimator has."""
    groups = {role: (getattr(params.ekf2, group, None), name)
              for role, (group, name) in DELAYS.items()}
    return {role: float(getattr(group, name)) for role, (group, name) in groups.items()
            if hasattr(group, name)}


def _further_delays_ms(params: Params, roles: Collection[str]) -> dict[str, float]:
    """Return the delays of receivers beside the first, of those among the roles."""
    return {role: float(getattr(params.receivers, role).delay_ms)
            for role in FIXES[1:] if role in roles}
