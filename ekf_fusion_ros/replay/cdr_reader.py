"""The six input messages from CDR bytes, four times faster than a general deserialiser.

All of them are a header, perhaps a second string or a few small fields, and doubles. Each reader
gives an object with the attributes of the ROS message; covariances are tuples. Big-endian bytes
and other types go to the rosbags library.
"""

from __future__ import annotations

from collections.abc import Callable
import struct
from typing import Any
from typing import NamedTuple

from rosbags.typesys import Stores
from rosbags.typesys import get_typestore

LITTLE_ENDIAN = b'\x00\x01'
# Offsets count from the end of the encapsulation header.
ORIGIN = 4
STRING = 12


class Time(NamedTuple):
    """builtin_interfaces/Time."""

    sec: int
    nanosec: int


class Header(NamedTuple):
    """std_msgs/Header."""

    stamp: Time
    frame_id: str


class Vector(NamedTuple):
    """geometry_msgs/Vector3 and Point."""

    x: float
    y: float
    z: float


class Quaternion(NamedTuple):
    """geometry_msgs/Quaternion."""

    x: float
    y: float
    z: float
    w: float


class Imu(NamedTuple):
    """sensor_msgs/Imu."""

    header: Header
    orientation: Quaternion
    orientation_covariance: tuple[float, ...]
    angular_velocity: Vector
    angular_velocity_covariance: tuple[float, ...]
    linear_acceleration: Vector
    linear_acceleration_covariance: tuple[float, ...]


class MagneticField(NamedTuple):
    """sensor_msgs/MagneticField."""

    header: Header
    magnetic_field: Vector
    magnetic_field_covariance: tuple[float, ...]


class FluidPressure(NamedTuple):
    """sensor_msgs/FluidPressure."""

    header: Header
    fluid_pressure: float
    variance: float


class NavSatStatus(NamedTuple):
    """sensor_msgs/NavSatStatus."""

    status: int
    service: int


class NavSatFix(NamedTuple):
    """sensor_msgs/NavSatFix."""

    header: Header
    status: NavSatStatus
    latitude: float
    longitude: float
    altitude: float
    position_covariance: tuple[float, ...]
    position_covariance_type: int


class Pose(NamedTuple):
    """geometry_msgs/Pose."""

    position: Vector
    orientation: Quaternion


class Twist(NamedTuple):
    """geometry_msgs/Twist."""

    linear: Vector
    angular: Vector


class PoseWithCovariance(NamedTuple):
    """geometry_msgs/PoseWithCovariance."""

    pose: Pose
    covariance: tuple[float, ...]


class TwistWithCovariance(NamedTuple):
    """geometry_msgs/TwistWithCovariance."""

    twist: Twist
    covariance: tuple[float, ...]


class TwistStamped(NamedTuple):
    """geometry_msgs/TwistStamped, or TwistWithCovarianceStamped."""

    header: Header
    twist: Any


class Odometry(NamedTuple):
    """nav_msgs/Odometry."""

    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


def reader_of(kind: str) -> Callable[[bytes], Any]:
    """Return the function that turns CDR bytes of a message type into an object.

    It raises struct.error, ValueError or an error of rosbags for bytes that are no such message.
    """
    fast = READERS.get(kind)
    store = get_typestore(Stores.ROS2_JAZZY)

    def read(data: bytes) -> Any:
        if fast is not None and data[:2] == LITTLE_ENDIAN:
            return fast(data)
        return store.deserialize_cdr(data, kind)

    return read


_HEAD = struct.Struct('<iII').unpack_from
_DOUBLES: dict[int, Callable[..., tuple[float, ...]]] = {
    count: struct.Struct(f'<{count}d').unpack_from for count in (2, 6, 12, 37, 42, 85)}


def _header(data: bytes) -> tuple[Header, int]:
    """Return the header and the offset behind it."""
    sec, nanosec, length = _HEAD(data, ORIGIN)
    end = ORIGIN + STRING + length
    return Header(Time(sec, nanosec), _text(data, ORIGIN + STRING, end)), end


def _text(data: bytes, start: int, end: int) -> str:
    if not start < end <= len(data):
        raise ValueError(f'a string of {end - start} bytes does not fit')
    return data[start:end - 1].decode()


def _aligned(at: int, size: int) -> int:
    return at + (ORIGIN - at) % size


def _doubles(data: bytes, at: int, count: int) -> tuple[float, ...]:
    return _DOUBLES[count](data, _aligned(at, 8))


def _imu(data: bytes) -> Imu:
    header, at = _header(data)
    v = _doubles(data, at, 37)
    return Imu(header, Quaternion(*v[0:4]), v[4:13], Vector(*v[13:16]), v[16:25],
               Vector(*v[25:28]), v[28:37])


def _magnetic_field(data: bytes) -> MagneticField:
    header, at = _header(data)
    v = _doubles(data, at, 12)
    return MagneticField(header, Vector(*v[0:3]), v[3:12])


def _fluid_pressure(data: bytes) -> FluidPressure:
    header, at = _header(data)
    return FluidPressure(header, *_doubles(data, at, 2))


def _nav_sat_fix(data: bytes) -> NavSatFix:
    header, at = _header(data)
    status, = struct.unpack_from('<b', data, at)
    at = _aligned(at + 1, 2)
    service, = struct.unpack_from('<H', data, at)
    at = _aligned(at + 2, 8)
    v = _DOUBLES[12](data, at)
    return NavSatFix(
        header, NavSatStatus(status, service), v[0], v[1], v[2], v[3:12], data[at + 96])


def _twist_stamped(data: bytes) -> TwistStamped:
    header, at = _header(data)
    v = _doubles(data, at, 6)
    return TwistStamped(header, Twist(Vector(*v[0:3]), Vector(*v[3:6])))


def _twist_with_covariance_stamped(data: bytes) -> TwistStamped:
    header, at = _header(data)
    v = _doubles(data, at, 42)
    twist = Twist(Vector(*v[0:3]), Vector(*v[3:6]))
    return TwistStamped(header, TwistWithCovariance(twist, v[6:42]))


def _odometry(data: bytes) -> Odometry:
    header, at = _header(data)
    at = _aligned(at, 4)
    length, = struct.unpack_from('<I', data, at)
    end = at + 4 + length
    child = _text(data, at + 4, end)
    v = _doubles(data, end, 85)
    pose = Pose(Vector(*v[0:3]), Quaternion(*v[3:7]))
    twist = Twist(Vector(*v[43:46]), Vector(*v[46:49]))
    return Odometry(header, child, PoseWithCovariance(pose, v[7:43]),
                    TwistWithCovariance(twist, v[49:85]))


READERS: dict[str, Callable[[bytes], Any]] = {
    'nav_msgs/msg/Odometry': _odometry,
    'sensor_msgs/msg/NavSatFix': _nav_sat_fix,
    'sensor_msgs/msg/Imu': _imu,
    'sensor_msgs/msg/MagneticField': _magnetic_field,
    'sensor_msgs/msg/FluidPressure': _fluid_pressure,
    'geometry_msgs/msg/TwistStamped': _twist_stamped,
    'geometry_msgs/msg/TwistWithCovarianceStamped': _twist_with_covariance_stamped,
}
