"""Stamps of messages."""

from __future__ import annotations

from builtin_interfaces.msg import Time

from ekf_fusion_ros.messages.stamps import seconds_nanoseconds


def stamp_message(time_us: int) -> Time:
    """Return a stamp of integer microseconds as a ROS message."""
    sec, nanosec = seconds_nanoseconds(time_us)
    return Time(sec=sec, nanosec=nanosec)
