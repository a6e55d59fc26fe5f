"""Header stamps and integer microseconds; nothing else converts between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.messages.refusal import Refused

SECOND_US = 1_000_000
NANOSECONDS = 1_000_000_000


def microseconds(sec: int, nanosec: int) -> int:
    """Return a stamp as integer microseconds, nanoseconds rounded to nearest, halves up."""
    return int(sec) * SECOND_US + (int(nanosec) + 500) // 1000


def seconds_nanoseconds(time_us: int) -> tuple[int, int]:
    """Return integer microseconds as (sec, nanosec) with 0 <= nanosec < 1e9."""
    sec, rest = divmod(time_us, SECOND_US)
    return sec, rest * 1000


def checked_stamp(sec: int, nanosec: int) -> int:
    """Return the header stamp of a message in integer microseconds.

    Raises Refused 'zero_stamp' for a stamp that is zero or negative, 'bad_stamp' for nanoseconds
    that fill a second or more.
    """
    if not 0 <= nanosec < NANOSECONDS:
        raise Refused(
            'bad_stamp', f'header.stamp.nanosec is {nanosec}: must be less than 1000000000')
    time_us = sec * SECOND_US + (nanosec + 500) // 1000
    if time_us <= 0:
        raise Refused(
            'zero_stamp',
            f'header.stamp is {sec}.{nanosec:09d}: the driver must stamp its messages')
    return time_us


def plain_stamps(
    sec: NDArray[np.int64], nanosec: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return stamps (n,) in microseconds, and which of them `checked_stamp` would take."""
    times = sec * SECOND_US + (nanosec + 500) // 1000
    return times, (times > 0) & (nanosec >= 0) & (nanosec < NANOSECONDS)
