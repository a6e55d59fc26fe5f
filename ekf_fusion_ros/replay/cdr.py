"""The two output messages as CDR bytes (little-endian), without building message objects.

Layout: OMG CDR as ROS 2 uses it; alignment counts from the byte after the encapsulation header.
"""

from __future__ import annotations

from functools import lru_cache
import struct

import numpy as np

from ekf_fusion_ros.messages.encode import NavSatFixFields
from ekf_fusion_ros.messages.encode import OdometryFields
from ekf_fusion_ros.messages.stamps import seconds_nanoseconds

ENCAPSULATION = b'\x00\x01\x00\x00'


def odometry_cdr(fields: OdometryFields) -> bytes:
    """Return nav_msgs/msg/Odometry."""
    head = _odometry_head(fields.frame_id, fields.child_frame_id)
    sec, nanosec = seconds_nanoseconds(fields.time_us)
    return b''.join((
        ENCAPSULATION, struct.pack('<iI', sec, nanosec), head,
        struct.pack('<7d', *fields.position, *fields.orientation),
        np.asarray(fields.pose_covariance, '<f8').tobytes(),
        struct.pack('<6d', *fields.linear, *fields.angular),
        np.asarray(fields.twist_covariance, '<f8').tobytes()))


def fix_cdr(fields: NavSatFixFields) -> bytes:
    """Return sensor_msgs/msg/NavSatFix."""
    sec, nanosec = seconds_nanoseconds(fields.time_us)
    head = _string(fields.frame_id) + struct.pack('<b', fields.status)
    head = _aligned(_aligned(head, 2) + struct.pack('<H', fields.service), 8)
    return b''.join((
        ENCAPSULATION, struct.pack('<iI', sec, nanosec), head,
        struct.pack('<3d', fields.latitude, fields.longitude, fields.altitude),
        np.asarray(fields.position_covariance, '<f8').tobytes(),
        struct.pack('<B', fields.position_covariance_type)))


@lru_cache(maxsize=8)
def _odometry_head(frame_id: str, child_frame_id: str) -> bytes:
    return _aligned(_aligned(_string(frame_id), 4) + _string(child_frame_id), 8)


def _string(text: str) -> bytes:
    data = text.encode() + b'\x00'
    return struct.pack('<I', len(data)) + data


def _aligned(data: bytes, size: int) -> bytes:
    """Pad what follows the 8 bytes of the stamp to a multiple of `size`."""
    return data + bytes(-len(data) % size)
