"""The input messages from CDR bytes, four times faster than a general deserialiser.

Nearly all of them are a header, perhaps a second string or a few small fields, and doubles. Each
reader gives an object with the attributes of the ROS message; covariances are tuples. Big-endian
bytes and other types go to the rosbags library.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
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


class Range(NamedTuple):
    """sensor_msgs/Range."""

    header: Header
    radiation_type: int
    field_of_view: float
    min_range: float
    max_range: float
    range: float
    variance: float


class Vector3Stamped(NamedTuple):
    """geometry_msgs/Vector3Stamped."""

    header: Header
    vector: Vector


class PoseStamped(NamedTuple):
    """geometry_msgs/PoseStamped, or PoseWithCovarianceStamped."""

    header: Header
    pose: Any


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


_LENGTH = struct.Struct('<I').unpack_from
_FIX = struct.Struct('<12dB').unpack_from
_FLOATS = struct.Struct('<4f').unpack_from
_VARIANCE = struct.Struct('<f')


def _length(data: bytes, at: int) -> int:
    """Return the length of a string that is to lie within the data, its final zero included."""
    length: int = _LENGTH(data, at)[0]
    if not 0 < length <= len(data):
        raise ValueError(f'a string of {length} bytes does not fit')
    return length


@lru_cache(maxsize=64)
def _layout(count: int, length: int, second: int = 0) -> Callable[..., tuple[Any, ...]]:
    """Return the reader of a header, perhaps a second string, and a number of doubles.

    The layout follows from the lengths of the strings, which hardly ever change.
    """
    words, end = f'<iII{length}s', STRING + length
    if second:
        words += f'{-end % 4}xI{second}s'
        end += -end % 4 + 4 + second
    return struct.Struct(f'{words}{-end % 8}x{count}d').unpack_from


@lru_cache(maxsize=64)
def _text(data: bytes) -> str:
    return data[:-1].decode()


def _numbers(data: bytes, count: int) -> tuple[Header, tuple[Any, ...]]:
    """Return the header and what was unpacked: its four words, then the doubles."""
    v = _layout(count, _length(data, ORIGIN + 8))(data, ORIGIN)
    return Header(Time(v[0], v[1]), _text(v[3])), v


def _imu(data: bytes) -> Imu:
    header, v = _numbers(data, 37)
    return Imu(header, Quaternion(*v[4:8]), v[8:17], Vector(*v[17:20]), v[20:29],
               Vector(*v[29:32]), v[32:41])


def _magnetic_field(data: bytes) -> MagneticField:
    header, v = _numbers(data, 12)
    return MagneticField(header, Vector(*v[4:7]), v[7:16])


def _fluid_pressure(data: bytes) -> FluidPressure:
    header, v = _numbers(data, 2)
    return FluidPressure(header, v[4], v[5])


def _nav_sat_fix(data: bytes) -> NavSatFix:
    header, v = _numbers(data, 0)
    at = STRING + len(v[3])
    status, = struct.unpack_from('<b', data, ORIGIN + at)
    at += 1 + -(at + 1) % 2
    service, = struct.unpack_from('<H', data, ORIGIN + at)
    at += 2 + -(at + 2) % 8
    v = _FIX(data, ORIGIN + at)
    return NavSatFix(header, NavSatStatus(status, service), v[0], v[1], v[2], v[3:12], v[12])


def _twist_stamped(data: bytes) -> TwistStamped:
    header, v = _numbers(data, 6)
    return TwistStamped(header, Twist(Vector(*v[4:7]), Vector(*v[7:10])))


def _twist_with_covariance_stamped(data: bytes) -> TwistStamped:
    header, v = _numbers(data, 42)
    twist = Twist(Vector(*v[4:7]), Vector(*v[7:10]))
    return TwistStamped(header, TwistWithCovariance(twist, v[10:46]))


def _range(data: bytes) -> Range:
    header, v = _numbers(data, 0)
    at = ORIGIN + STRING + len(v[3])
    kind = data[at]
    at += 1 + -(at - ORIGIN + 1) % 4
    numbers = _FLOATS(data, at)
    at += 16
    # Recordings of ROS 2 Humble end here.
    variance = _VARIANCE.unpack_from(data, at)[0] if len(data) >= at + 4 else 0.0
    return Range(header, kind, *numbers, variance)


def _vector_stamped(data: bytes) -> Vector3Stamped:
    header, v = _numbers(data, 3)
    return Vector3Stamped(header, Vector(*v[4:7]))


def _pose_stamped(data: bytes) -> PoseStamped:
    header, v = _numbers(data, 7)
    return PoseStamped(header, Pose(Vector(*v[4:7]), Quaternion(*v[7:11])))


def _pose_with_covariance_stamped(data: bytes) -> PoseStamped:
    header, v = _numbers(data, 43)
    pose = Pose(Vector(*v[4:7]), Quaternion(*v[7:11]))
    return PoseStamped(header, PoseWithCovariance(pose, v[11:47]))


def _odometry(data: bytes) -> Odometry:
    length = _length(data, ORIGIN + 8)
    second = _length(data, ORIGIN + STRING + length + -length % 4)
    v = _layout(85, length, second)(data, ORIGIN)
    header = Header(Time(v[0], v[1]), _text(v[3]))
    pose = Pose(Vector(*v[6:9]), Quaternion(*v[9:13]))
    twist = Twist(Vector(*v[49:52]), Vector(*v[52:55]))
    return Odometry(header, _text(v[5]), PoseWithCovariance(pose, v[13:49]),
                    TwistWithCovariance(twist, v[55:91]))


READERS: dict[str, Callable[[bytes], Any]] = {
    'nav_msgs/msg/Odometry': _odometry,
    'sensor_msgs/msg/NavSatFix': _nav_sat_fix,
    'sensor_msgs/msg/Imu': _imu,
    'sensor_msgs/msg/MagneticField': _magnetic_field,
    'sensor_msgs/msg/FluidPressure': _fluid_pressure,
    'sensor_msgs/msg/Range': _range,
    'geometry_msgs/msg/Vector3Stamped': _vector_stamped,
    'geometry_msgs/msg/PoseStamped': _pose_stamped,
    'geometry_msgs/msg/PoseWithCovarianceStamped': _pose_with_covariance_stamped,
    'geometry_msgs/msg/TwistStamped': _twist_stamped,
    'geometry_msgs/msg/TwistWithCovarianceStamped': _twist_with_covariance_stamped,
}
