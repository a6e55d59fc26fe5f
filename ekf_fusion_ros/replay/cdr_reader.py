"""The input messages from CDR bytes, as the flat form that the decoders take.

Nearly all are a header, perhaps a second string or a few small fields, and doubles: one
struct for each length of the strings reads the whole message. Big-endian bytes and other types
go to the rosbags library.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from functools import partial
import struct
from typing import Any

from rosbags.typesys import Stores
from rosbags.typesys import get_typestore

from ekf_fusion_ros.messages.flat import FlatMessage

LITTLE_ENDIAN = b'\x00\x01'
# Offsets count from the end of the encapsulation header.
ORIGIN = 4
STRING = 12


def reader_of(kind: str) -> Callable[[bytes], Any]:
    """Return the function that turns CDR bytes of a message type into a message.

    It gives a FlatMessage, or an object of rosbags. It raises struct.error, ValueError or an
    error of rosbags for bytes that are no such message.
    """
    fast = READERS.get(kind)
    store = get_typestore(Stores.ROS2_JAZZY)

    def read(data: bytes) -> Any:
        if fast is not None and data[:2] == LITTLE_ENDIAN:
            return fast(data)
        return store.deserialize_cdr(data, kind)

    return read


_LENGTH = struct.Struct('<I').unpack_from


def _length(data: bytes, at: int) -> int:
    """Return the length of a string that is to lie within the data, its final zero included."""
    length: int = _LENGTH(data, at)[0]
    if not 0 < length <= len(data):
        raise ValueError(f'a string of {length} bytes does not fit')
    return length


@lru_cache(maxsize=64)
def _layout(numbers: str, length: int) -> Callable[..., tuple[Any, ...]]:
    """Return the reader of a header and of what follows it, aligned to 8 bytes.

    The layout follows from the length of the frame's name, which hardly ever changes.
    """
    return struct.Struct(f'<iI4x{length}s{_padding(length)}{numbers}').unpack_from


@lru_cache(maxsize=64)
def _odometry_layout(length: int, second: int) -> Callable[..., tuple[Any, ...]]:
    gap = -length % 4
    rest = f'{gap + 4}x{second}s{_padding(length + gap + 4 + second)}85d'
    return struct.Struct(f'<iI4x{length}s{rest}').unpack_from


@lru_cache(maxsize=64)
def _fix_layout(length: int) -> Callable[..., tuple[Any, ...]]:
    """Return the reader of a NavSatFix: its two small fields stand before the doubles."""
    gap = -(length + 1) % 2
    rest = f'b{gap}xH{_padding(length + 1 + gap + 2)}12dB'
    return struct.Struct(f'<iI4x{length}s{rest}').unpack_from


@lru_cache(maxsize=64)
def _range_layout(length: int, floats: int) -> Callable[..., tuple[Any, ...]]:
    return struct.Struct(f'<iI4x{length}sB{-(length + 1) % 4}x{floats}f').unpack_from


def _padding(length: int) -> str:
    """Return the pad bytes before a double, so many bytes after the length of the first string."""
    return f'{-(STRING + length) % 8}x'


@lru_cache(maxsize=64)
def _text(data: bytes) -> str:
    return data[:-1].decode()


def _doubles(numbers: str, data: bytes) -> FlatMessage:
    v = _layout(numbers, _length(data, ORIGIN + 8))(data, ORIGIN)
    return FlatMessage(v[0], v[1], _text(v[2]), v[3:])


def _nav_sat_fix(data: bytes) -> FlatMessage:
    v = _fix_layout(_length(data, ORIGIN + 8))(data, ORIGIN)
    return FlatMessage(v[0], v[1], _text(v[2]), v[3:])


def _range(data: bytes) -> FlatMessage:
    length = _length(data, ORIGIN + 8)
    # Recordings of ROS 2 Humble have no variance at the end.
    end = ORIGIN + STRING + length + 1 + -(length + 1) % 4
    v = _range_layout(length, 5 if len(data) >= end + 20 else 4)(data, ORIGIN)
    return FlatMessage(v[0], v[1], _text(v[2]), v[3:])


def _odometry(data: bytes) -> FlatMessage:
    length = _length(data, ORIGIN + 8)
    second = _length(data, ORIGIN + STRING + length + -length % 4)
    v = _odometry_layout(length, second)(data, ORIGIN)
    return FlatMessage(v[0], v[1], _text(v[2]), v[4:], _text(v[3]))


READERS: dict[str, Callable[[bytes], FlatMessage]] = {
    'nav_msgs/msg/Odometry': _odometry,
    'sensor_msgs/msg/NavSatFix': _nav_sat_fix,
    'sensor_msgs/msg/Imu': partial(_doubles, '37d'),
    'sensor_msgs/msg/MagneticField': partial(_doubles, '12d'),
    'sensor_msgs/msg/FluidPressure': partial(_doubles, '2d'),
    'sensor_msgs/msg/Range': _range,
    'geometry_msgs/msg/Vector3Stamped': partial(_doubles, '3d'),
    'geometry_msgs/msg/PoseStamped': partial(_doubles, '7d'),
    'geometry_msgs/msg/PoseWithCovarianceStamped': partial(_doubles, '43d'),
    'geometry_msgs/msg/TwistStamped': partial(_doubles, '6d'),
    'geometry_msgs/msg/TwistWithCovarianceStamped': partial(_doubles, '42d'),
}
