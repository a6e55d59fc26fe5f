"""sensor_msgs/NavSatFix and the velocity of a receiver to samples."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros import frames
from ekf_fusion_ros.messages import fields
from ekf_fusion_ros.messages.flat import FlatMessage
from ekf_fusion_ros.messages.flat import elements
from ekf_fusion_ros.messages.flat import flat_message
from ekf_fusion_ros.messages.flat import xyz
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import checked_stamp
from ekf_fusion_ros.params.messages import FixMessageParams
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import GnssSample

Array = NDArray[np.float64]

# NavSatStatus to PX4's fix types: 3-D, differential, RTK.
FIX_TYPES = {0: 3, 1: 4, 2: 6}
NO_FIX = -1

# Places in the flat messages: NavSatFix, then the twists of both kinds.
STATUS, POSITION, POSITION_COVARIANCE, COVARIANCE_TYPE = 0, slice(2, 5), slice(5, 14), 14
LINEAR, TWIST_COVARIANCE = slice(0, 3), slice(6, 42)

COVARIANCE_UNKNOWN = 0
COVARIANCE_KNOWN = 3

MAX_ALTITUDE = 1e5
MAX_VELOCITY = 1e3
UNMEASURED_VARIANCE = 9e4


class FixVelocity(NamedTuple):
    """Velocity (3,) m/s NED of a receiver and its 1-sigma accuracy in m/s."""

    time_us: int
    velocity: Array
    accuracy: float


def decode_fix(message: Any, params: MessageParams) -> GnssSample:
    """Return a NavSatFix as a sample without velocity.

    A NaN altitude stays NaN: latitude and longitude are good without it. Satellites and PDOP are
    None, since NavSatFix has none. Raises Refused.
    """
    flat = message if isinstance(message, FlatMessage) else _flat_fix(message)
    time_us = checked_stamp(flat.sec, flat.nanosec)
    fix_type = _fix_type(int(flat.numbers[STATUS]))
    lat, lon, alt = flat.numbers[POSITION]
    fields.check_finite((lat, lon), 'latitude, longitude')
    if abs(lat) > 90.0:
        raise Refused('bad_latitude', f'latitude is {lat:g} deg: beyond 90')
    if abs(lon) > 180.0:
        raise Refused('bad_longitude', f'longitude is {lon:g} deg: beyond 180')
    if lat == 0.0 and lon == 0.0:
        raise Refused('zero_position', 'latitude and longitude are both 0: not a fix')
    if abs(alt) > MAX_ALTITUDE:
        raise Refused('bad_altitude', f'altitude is {alt:g} m: beyond {MAX_ALTITUDE:g}')
    eph, epv = accuracies(
        int(flat.numbers[COVARIANCE_TYPE]), flat.numbers[POSITION_COVARIANCE], params.fix)
    return GnssSample(
        time_us, float(lat), float(lon), float(alt), eph, epv, fix_type=fix_type)


def decode_fix_velocity(message: Any, params: MessageParams) -> FixVelocity:
    """Return a TwistStamped or TwistWithCovarianceStamped as a velocity in NED.

    The velocity is ENU unless the frame name ends in _ned. The accuracy is that of the worst
    axis. Raises Refused.
    """
    flat = message if isinstance(message, FlatMessage) else flat_twist(message)
    time_us = checked_stamp(flat.sec, flat.nanosec)
    linear, covariance = flat.numbers[LINEAR], flat.numbers[TWIST_COVARIANCE]
    fields.check_vector(linear, 'twist.linear', MAX_VELOCITY)
    velocity = np.array(linear, np.float64)
    if frames.frame_kind(flat.frame_id) == 'enu':
        velocity = frames.swap_enu_ned(velocity)
    variance = 0.0
    if covariance:
        fields.check_variances(covariance, (0, 7, 14), 'twist.covariance')
        variance = float(max(covariance[0], covariance[7], covariance[14]))
    if variance >= UNMEASURED_VARIANCE:
        raise Refused(
            'not_measured', f'twist.covariance says that an axis was not measured: {variance:g}')
    accuracy = math.sqrt(variance) or params.fix_velocity.default_accuracy
    return FixVelocity(time_us, velocity, max(accuracy, params.fix_velocity.min_accuracy))


def accuracies(
        kind: int, covariance: Sequence[float], params: FixMessageParams) -> tuple[float, float]:
    """Return the horizontal and vertical 1-sigma accuracy of a NavSatFix in m.

    By its `position_covariance_type`: UNKNOWN gives the defaults whatever the matrix holds;
    APPROXIMATED and DIAGONAL_KNOWN give the larger horizontal variance and the vertical one;
    KNOWN gives the major axis of the horizontal error ellipse. A zero variance means unknown.
    """
    if kind == COVARIANCE_UNKNOWN:
        return params.default_eph, params.default_epv
    if not COVARIANCE_UNKNOWN < kind <= COVARIANCE_KNOWN:
        raise Refused('bad_covariance', f'position_covariance_type is {kind}: not 0 to 3')
    fields.check_variances(covariance, (0, 4, 8), 'position_covariance')
    east, north, up = float(covariance[0]), float(covariance[4]), float(covariance[8])
    horizontal = max(east, north)
    if kind == COVARIANCE_KNOWN:
        horizontal = _major_variance(east, north, float(covariance[1]), float(covariance[3]))
    if not math.isfinite(horizontal + up):
        raise Refused('not_finite', 'position_covariance is not finite')
    eph = math.sqrt(horizontal) or params.default_eph
    epv = math.sqrt(up) or params.default_epv
    return max(eph, params.min_eph), max(epv, params.min_epv)


def _flat_fix(message: Any) -> FlatMessage:
    covariance = elements(message.position_covariance, 9, 'position_covariance')
    return flat_message(message, (
        message.status.status, message.status.service, message.latitude, message.longitude,
        message.altitude, *covariance, message.position_covariance_type))


def flat_twist(message: Any) -> FlatMessage:
    """Return a TwistStamped or TwistWithCovarianceStamped flat."""
    covariance: list[float] = []
    twist = message.twist
    if hasattr(twist, 'covariance'):
        covariance = elements(twist.covariance, 36, 'twist.covariance')
        twist = twist.twist
    return flat_message(message, (*xyz(twist.linear), *xyz(twist.angular), *covariance))


def _fix_type(status: int) -> int:
    if status in FIX_TYPES:
        return FIX_TYPES[status]
    if status == NO_FIX:
        raise Refused('no_fix', 'status.status is -1: the receiver has no fix')
    raise Refused(
        'unknown_status', f'status.status is {status}: the driver must set 0, 1 or 2 for a fix')


def _major_variance(east: float, north: float, upper: float, lower: float) -> float:
    """Return the larger eigenvalue of the horizontal block."""
    if math.isnan(upper + lower):
        raise Refused('nan_covariance', 'position_covariance holds NaN')
    cross = 0.5 * (upper + lower)
    if cross * cross > 1.001 * east * north + 1e-30:
        raise Refused('indefinite_covariance', 'position_covariance has a correlation beyond 1')
    return 0.5 * (east + north) + math.hypot(0.5 * (east - north), cross)
