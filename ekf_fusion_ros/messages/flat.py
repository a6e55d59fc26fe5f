"""A message as its decoder takes it: header and numbers, without objects inside objects.

A recording's bytes give this form at once; a message of rclpy or rosbags is flattened first. The
rules of the decoders work on it, so that they exist once.
"""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Iterator
from collections.abc import Sequence
from functools import partial
from typing import Any
from typing import NamedTuple
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.messages.refusal import Refused

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Record = TypeVar('Record', bound=tuple[Any, ...])


class FlatMessage(NamedTuple):
    """Stamp, frame and all numbers of a message in the order of its definition.

    numbers: in the units of the message, strings left out; each decoder names the places.
    """

    sec: int
    nanosec: int
    frame_id: str
    numbers: Sequence[float]
    child_frame_id: str = ''


class FlatRows(NamedTuple):
    """Messages of one type and one pair of frames, so many that they are judged together.

    sec, nanosec (n,) integers; numbers (n, m), a row as FlatMessage has them.
    """

    sec: Integers
    nanosec: Integers
    numbers: Array
    frame_id: str
    child_frame_id: str = ''

    def row(self, index: int) -> FlatMessage:
        """Return one message."""
        return FlatMessage(int(self.sec[index]), int(self.nanosec[index]), self.frame_id,
                           self.numbers[index].tolist(), self.child_frame_id)


def named(kind: type[Record], rows: Iterable[tuple[Any, ...]]) -> Iterator[Record]:
    """Yield rows as named tuples; each must hold all fields of `kind`, which nothing checks.

    At a third of the cost of `_make` for each.
    """
    return map(partial(tuple.__new__, kind), rows)


def where_good(samples: Iterable[Record], good: NDArray[np.bool_]) -> list[Record | None]:
    """Return samples as a list, with None in place of those that are not good."""
    if good.all():
        return list(samples)
    return [sample if plain else None
            for plain, sample in zip(good.tolist(), samples, strict=True)]


def flat_message(message: Any, numbers: Sequence[float], child_frame_id: str = '') -> FlatMessage:
    """Return the numbers of a message under its header."""
    header = message.header
    return FlatMessage(
        int(header.stamp.sec), int(header.stamp.nanosec), header.frame_id, numbers, child_frame_id)


def xyz(vector: Any) -> tuple[float, float, float]:
    """Return the elements of a Vector3 or Point."""
    return vector.x, vector.y, vector.z


def xyzw(quaternion: Any) -> tuple[float, float, float, float]:
    """Return the elements of a Quaternion in the order of the message."""
    return quaternion.x, quaternion.y, quaternion.z, quaternion.w


def elements(array: Any, count: int, name: str) -> list[float]:
    """Return the elements of an array field; raise Refused 'bad_covariance' unless `count`."""
    flat: list[float] = np.asarray(array, dtype=np.float64).ravel().tolist()
    if len(flat) != count:
        raise Refused('bad_covariance', f'{name} has {len(flat)} elements, not {count}')
    return flat
