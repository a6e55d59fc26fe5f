"""The input messages from CDR bytes, as the flat form that the decoders take.

Nearly all are a header, perhaps a second string or a few small fields, and doubles: one
struct for each length of the strings reads the whole message. Big-endian bytes and other types
go to the rosbags library.
"""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Sequence
from functools import lru_cache
from functools import partial
import struct
from typing import Any

import numpy as np
from rosbags.typesys import Stores
from rosbags.typesys import get_typestore

from ekf_fusion_ros.messages.flat import FlatMessage
from ekf_fusion_ros.messages.flat import FlatRows

LITTLE_ENDIAN = b'\x00\x01'
LITTLE = np.frombuffer(LITTLE_ENDIAN, np.uint8)
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


def rows_of(kind: str, messages: Sequence[bytes]) -> FlatRows | None:
    """Return messages of a type of TABLES, None unless all have one layout and one frame.

    Raises ValueError for bytes that are no such messages.
    """
    strings, numbers = TABLES[kind]
    first = messages[0]
    names, end = [], ORIGIN + 8
    for _ in range(strings):
        begin = end + -(end - ORIGIN) % 4
        end = begin + 4 + _length(first, begin)
        names.append(slice(begin, end))
    begin = end + -(end - ORIGIN) % 8
    size = begin + 8 * numbers
    if set(map(len, messages)) != {len(first)} or len(first) < size:
        return None
    table = np.frombuffer(b''.join(messages), np.uint8).reshape(len(messages), -1)
    alike = all((table[:, name] == table[0, name]).all() for name in names)
    if not alike or (table[:, :2] != LITTLE).any():
        return None
    stamps = np.ascontiguousarray(table[:, ORIGIN:ORIGIN + 8]).view('<i4, <u4')[:, 0]
    values = np.ascontiguousarray(table[:, begin:size]).view('<f8').astype(np.float64, copy=False)
    return FlatRows(stamps['f0'].astype(np.int64), stamps['f1'].astype(np.int64),
                    values, *(_text(first[name][4:]) for name in names))


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


# Messages that are a header and so many doubles.
DOUBLES = {
    'sensor_msgs/msg/Imu': 37,
    'sensor_msgs/msg/MagneticField': 12,
    'sensor_msgs/msg/FluidPressure': 2,
    'geometry_msgs/msg/Vector3Stamped': 3,
    'geometry_msgs/msg/PoseStamped': 7,
    'geometry_msgs/msg/PoseWithCovarianceStamped': 43,
    'geometry_msgs/msg/TwistStamped': 6,
    'geometry_msgs/msg/TwistWithCovarianceStamped': 42,
}
# Strings after the stamp, and doubles after them, of what can be read as a table.
TABLES = {
    'nav_msgs/msg/Odometry': (2, 85),
    **{kind: (1, count) for kind, count in DOUBLES.items()},
}
READERS: dict[str, Callable[[bytes], FlatMessage]] = {
    'nav_msgs/msg/Odometry': _odometry,
    'sensor_msgs/msg/NavSatFix': _nav_sat_fix,
    'sensor_msgs/msg/Range': _range,
    **{kind: partial(_doubles, f'{count}d') for kind, count in DOUBLES.items()},
}
