"""Translate PX4 and ECL parameters, with their bit masks and enumerations, into ours."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Mapping
from collections.abc import Sequence
import math
from pathlib import Path
from typing import Any

import numpy as np

from ekf_fusion_ros.params.ekf2 import HEIGHT_REFERENCES
from ekf_fusion_ros.params.ekf2 import MAG_TYPES
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.health import HealthParams
from ekf_fusion_ros.params.lpe import LpeParams
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.params.receivers import ReceiversParams
from ekf_fusion_ros.params.spec import leaves

CHECKS = 'nsats pdop hacc vacc sacc hdrift vdrift hspeed vspeed'.split()

# One entry a bit: our parameter, or in words what the bit switches where we have nothing.
AID_BITS = (
    'ekf2.gnss.enabled', 'ekf2.flow.enabled', 'ekf2.imu.inhibit_accel_bias',
    'ekf2.vision.use_position', 'ekf2.vision.use_yaw', 'ekf2.air_data.use_drag',
    'ekf2.vision.rotate', 'ekf2.gnss.yaw', 'ekf2.vision.use_velocity',
)
CHECK_BITS = tuple(f'ekf2.gnss.checks.{check}' for check in CHECKS)
DECLINATION_BITS = (
    'ekf2.mag.declination_from_table', 'saving the declination', 'ekf2.mag.declination_always',
)
GPS_CONTROL_BITS = (
    'ekf2.gnss.enabled', 'GNSS height beside the height reference',
    'GNSS velocity, which goes with position here', 'ekf2.gnss.yaw',
)
# Bit 0 is all that the boolean of July 2021 had.
MAG_CHECK_BITS = ('ekf2.mag.check_strength', 'ekf2.mag.check_inclination',
                  'waiting for the field model')
TERRAIN_BITS = ('ekf2.terrain.use_range', 'ekf2.terrain.use_flow')
EV_CONTROL_BITS = (
    'ekf2.vision.use_position', 'vision height beside the height reference',
    'ekf2.vision.use_velocity', 'ekf2.vision.use_yaw',
)
LPE_BITS = (
    'lpe.gnss.enabled', 'lpe.flow.enabled', 'lpe.vision.enabled', 'lpe.landing_target.enabled',
    'lpe.land.enabled', 'lpe.agl_as_height', 'lpe.flow.gyro_compensation', 'lpe.baro.enabled',
)

OURS = ('ekf2.', 'lpe.')
BIT_MASKS = {
    'fusion_mode': AID_BITS,
    'EKF2_AID_MASK': AID_BITS,
    'gps_check_mask': CHECK_BITS,
    'EKF2_GPS_CHECK': CHECK_BITS,
    'mag_declination_source': DECLINATION_BITS,
    'EKF2_DECL_TYPE': DECLINATION_BITS,
    'EKF2_MAG_CHECK': MAG_CHECK_BITS,
    'terrain_fusion_mode': TERRAIN_BITS,
    'EKF2_TERR_MASK': TERRAIN_BITS,
    'EKF2_EV_CTRL': EV_CONTROL_BITS,
    'EKF2_GPS_CTRL': GPS_CONTROL_BITS,
    'LPE_FUSION': LPE_BITS,
}
ENUMERATIONS = {
    'vdist_sensor_type': ('ekf2.height.reference', HEIGHT_REFERENCES),
    'EKF2_HGT_MODE': ('ekf2.height.reference', HEIGHT_REFERENCES),
    'EKF2_HGT_REF': ('ekf2.height.reference', HEIGHT_REFERENCES),
    'mag_fusion_type': ('ekf2.mag.type', MAG_TYPES),
    'EKF2_MAG_TYPE': ('ekf2.mag.type', MAG_TYPES),
}
SWITCHES = {
    'check_mag_strength': 'ekf2.mag.check_strength',
    'synthesize_mag_z': 'ekf2.mag.synthesize_z',
    'EKF2_SYNT_MAG_Z': 'ekf2.mag.synthesize_z',
    'range_aid': 'ekf2.range.aid',
    'EKF2_RNG_AID': 'ekf2.range.aid',
    'EKF2_FUSE_BETA': 'ekf2.air_data.use_sideslip',
    'COM_ARM_WO_GPS': 'health.arm_without_gps',
}
KIND_OF_VEHICLE = 'MAV_TYPE'
"""What the flight stack of EKF2 looks at: airspeed, wings, wheels."""

BREAKER, BREAKER_KEY = 'CBRK_VELPOSERR', 201607
"""Circuit breaker of the take-off test; it breaks at one value only."""

# Of MAVLink's MAV_TYPE. A VTOL is none of these: it flies both ways.
VEHICLES = {
    1: 'fixed_wing', 2: 'multirotor', 3: 'multirotor', 4: 'multirotor', 10: 'rover',
    13: 'multirotor', 14: 'multirotor', 15: 'multirotor', 29: 'multirotor', 35: 'multirotor',
}
HEALTH = HealthParams()
CONCERNING = {KIND_OF_VEHICLE} | {spec.px4 for _, _, spec in leaves(HEALTH)}
"""Names outside of EKF2 that mean something here: the vehicle, and the commander's judgement."""

MICROSECONDS = {
    'valid_timeout_max': 'ekf2.aiding.valid_timeout',
    'EKF2_NOAID_TOUT': 'ekf2.aiding.valid_timeout',
    'reset_timeout_max': 'ekf2.aiding.reset_timeout',
}
# The same number under a name that its parameter does not have for its own.
SECONDS = {'EKF2_REQ_GPS_H': 'ekf2.gnss.checks.health_time'}
MILLISECONDS = {'EKF2_MIN_OBS_DT': 'ekf2.timing.sensor_interval_min_ms'}
AXES = {
    'EKF2_IMU_POS_': 'ekf2.imu.position',
    'EKF2_GPS_POS_': 'ekf2.gnss.position',
    'EKF2_EV_POS_': 'ekf2.vision.position',
    'EKF2_RNG_POS_': 'ekf2.range.position',
    'EKF2_OF_POS_': 'ekf2.flow.position',
}


def translate(foreign: Mapping[str, Any], base: Ekf2Params) -> tuple[dict[str, Any], list[str]]:
    """Return {our dotted name: value} and what has no counterpart here, in words.

    `foreign` holds PX4 (EKF2_*) or ECL names with numbers, or tuples for ECL vectors; `base`
    gives the axes of a vector that PX4 does not mention. Raises ValueError naming the parameter
    when an enumeration or a mask does not have that value.
    """
    values: dict[str, Any] = {}
    unused: list[str] = []
    plain = _plain_names(base)
    vectors = {f'ekf2.{name}': value for name, value, _ in leaves(base)}
    for name, value in foreign.items():
        if name in BIT_MASKS:
            _expand_mask(name, value, BIT_MASKS[name], values, unused)
        elif name in ENUMERATIONS:
            target, words = ENUMERATIONS[name]
            values[target] = _chosen(name, value, words)
        elif name in SWITCHES:
            values[SWITCHES[name]] = _whole(name, value) != 0
        elif name == KIND_OF_VEHICLE:
            _choose_vehicle(name, value, values, unused)
        elif name == BREAKER:
            values['health.takeoff_test'] = _whole(name, value) != BREAKER_KEY
        elif name in MICROSECONDS:
            values[MICROSECONDS[name]] = _scalar(name, value) * 1e-6
        elif name[:-1] in AXES and name[-1] in 'XYZ':
            target = AXES[name[:-1]]
            vector = list(values.get(target, vectors[target]))
            vector['XYZ'.index(name[-1])] = _scalar(name, value)
            values[target] = tuple(vector)
        elif name in plain:
            values[plain[name]] = value
        else:
            unused.append(name)
    return values, unused


def counterparts(name: str) -> list[str]:
    """Return the parameters here that a PX4 or ECL name stands for, none where it is unknown."""
    if name in BIT_MASKS:
        return [target for target in BIT_MASKS[name] if target.startswith(OURS)]
    if name in ENUMERATIONS:
        return [ENUMERATIONS[name][0]]
    axes = {first + axis: target for first, target in AXES.items() for axis in 'XYZ'}
    ours = _plain_names(Ekf2Params()) | SWITCHES | MICROSECONDS | axes
    return [ours[name]] if name in ours else []


def _plain_names(base: Ekf2Params) -> dict[str, str]:
    names = SECONDS | MILLISECONDS
    for tree, prefix in ((base, 'ekf2.'), (LpeParams(), 'lpe.'), (MessageParams(), 'messages.'),
                         (ReceiversParams(), 'receivers.'), (HEALTH, 'health.')):
        for name, _, spec in leaves(tree, prefix):
            names.update({foreign: name for foreign in (spec.px4, spec.ecl) if foreign})
    return names


def shortest(value: float) -> float:
    """Return the number that was meant by a single-precision one: 0.1, not 0.100000001."""
    # A whole number may be an integer parameter, with more digits than single precision holds.
    return value if value.is_integer() else float(str(np.float32(value)))


def _expand_mask(
    name: str, value: Any, bits: Sequence[str], values: dict[str, Any], unused: list[str]
) -> None:
    mask = _whole(name, value)
    if mask < 0:
        raise ValueError(f'{name} = {value}: a bit mask is not negative')
    for index in range(max(len(bits), mask.bit_length())):
        is_set = bool(mask >> index & 1)
        target = bits[index] if index < len(bits) else 'not a bit that is known'
        if target.startswith(OURS):
            values[target] = is_set
        elif is_set:
            unused.append(f'{name} bit {index} ({target})')


def _chosen(name: str, value: Any, words: Sequence[str]) -> str:
    index = _whole(name, value)
    if not 0 <= index < len(words):
        options = ', '.join(f'{i} {word}' for i, word in enumerate(words))
        raise ValueError(f'{name} = {value}: choose one of {options}')
    return words[index]


def _choose_vehicle(
    name: str, value: Any, values: dict[str, Any], unused: list[str],
) -> None:
    kind = _whole(name, value)
    if kind in VEHICLES:
        values['ekf2.aiding.vehicle'] = VEHICLES[kind]
    else:
        unused.append(f'{name} {kind} (no kind of vehicle that makes a difference)')


def _scalar(name: str, value: Any) -> float:
    if isinstance(value, tuple) or not math.isfinite(value):
        raise ValueError(f'{name} = {value}: expected one finite number')
    return float(value)


def _whole(name: str, value: Any) -> int:
    number = _scalar(name, value)
    if not number.is_integer():
        raise ValueError(f'{name} = {value}: expected an integer')
    return int(number)


def concerns_filter(name: str) -> bool:
    """Return whether a PX4 parameter is one that `translate` knows about."""
    return name.startswith(('EKF2_', 'LPE_', 'ATT_')) or name in CONCERNING


def read_px4(path: Path) -> tuple[dict[str, float], list[str]]:
    """Return the parameters of a PX4 .params file that `translate` knows, and the rest in words.

    Lines are `vehicle component NAME value type`, `#` starts a comment. Raises ValueError naming
    file and line.
    """
    values: dict[str, float] = {}
    others = 0
    for number, line in _lines(path):
        fields = line.split()
        if len(fields) != 5:
            raise ValueError(f'{path} line {number}: expected "vehicle component NAME value type"')
        if concerns_filter(fields[2]):
            values[fields[2]] = _number(path, number, fields[3])
        else:
            others += 1
    return values, [f'{others} parameters of other PX4 modules'] if others else []


def read_ecl(path: Path) -> dict[str, Any]:
    """Return {name: number or tuple} of `name=value` lines with ECL names; vectors are x;y;z.

    Raises ValueError naming file and line.
    """
    values: dict[str, Any] = {}
    for number, line in _lines(path):
        name, equals, text = line.partition('=')
        if not equals:
            raise ValueError(f'{path} line {number}: expected name=value')
        parts = tuple(_number(path, number, part) for part in text.split(';'))
        values[name.strip()] = parts[0] if len(parts) == 1 else parts
    return values


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    try:
        text = path.read_text(encoding='utf-8')
    except UnicodeDecodeError:
        raise ValueError(f'{path}: not a text file') from None
    for number, line in enumerate(text.splitlines(), start=1):
        content = line.partition('#')[0].strip()
        if content:
            yield number, content


def _number(path: Path, line: int, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f'{path} line {line}: {text.strip()!r} is not a number') from None
