"""The two output messages as CDR bytes (little-endian), without building message objects.

Layout: OMG CDR as ROS 2 uses it; alignment counts from the byte after the encapsulation header.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
import struct

import numpy as np

from ekf_fusion_ros.messages.encode import NavSatFixFields
from ekf_fusion_ros.messages.encode import OdometryFields
from ekf_fusion_ros.messages.stamps import seconds_nanoseconds

ENCAPSULATION = b'\x00\x01\x00\x00'
_STAMP = struct.Struct('<4siI')


def odometry_cdr(fields: OdometryFields) -> bytes:
    """Return nav_msgs/msg/Odometry."""
    return b''.join((
        _STAMP.pack(ENCAPSULATION, *seconds_nanoseconds(fields.time_us)),
        _odometry_head(fields.frame_id, fields.child_frame_id),
        np.asarray(fields.numbers, '<f8').tobytes()))


def fix_cdr(fields: NavSatFixFields) -> bytes:
    """Return sensor_msgs/msg/NavSatFix."""
    pack, frame = _fix_layout(fields.frame_id)
    return pack(
        ENCAPSULATION, *seconds_nanoseconds(fields.time_us), frame, fields.status, fields.service,
        fields.latitude, fields.longitude, fields.altitude, *fields.position_covariance.tolist(),
        fields.position_covariance_type)


@lru_cache(maxsize=8)
def _odometry_head(frame_id: str, child_frame_id: str) -> bytes:
    return _aligned(_aligned(_string(frame_id), 4) + _string(child_frame_id), 8)


@lru_cache(maxsize=8)
def _fix_layout(frame_id: str) -> tuple[Callable[..., bytes], bytes]:
    """Return what packs a fix, and its frame's name as it takes it."""
    frame = _string(frame_id)
    at = len(frame)
    gap = -(at + 1) % 2
    tail = -(at + 1 + gap + 2) % 8
    return struct.Struct(f'<4siI{at}sb{gap}xH{tail}x12dB').pack, frame


def _string(text: str) -> bytes:
    data = text.encode() + b'\x00'
    return struct.pack('<I', len(data)) + data


def _aligned(data: bytes, size: int) -> bytes:
    """Pad what follows the 8 bytes of the stamp to a multiple of `size`."""
    return data + bytes(-len(data) % size)
