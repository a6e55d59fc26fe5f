"""Messages of a recording to samples, a batch at a time."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Mapping
from collections.abc import Sequence
from typing import Any

from ekf_fusion_ros.messages.flat import FlatMessage
from ekf_fusion_ros.messages.flat import FlatRows
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import microseconds
from ekf_fusion_ros.replay.cdr_reader import TABLES
from ekf_fusion_ros.replay.cdr_reader import reader_of
from ekf_fusion_ros.replay.cdr_reader import rows_of
from ekf_fusion_ros.replay.storage import Message
from ekf_fusion_ros.replay.storage import Topic
from ekf_fusion_ros.replay.withholding import Withholding
from ekf_fusion_ros.session import FusionSession

Decoded = tuple[str, Any]


class BatchDecoder:
    """Decodes messages for a session: each by itself, or those of one role together."""

    def __init__(
        self, topics: Mapping[str, Topic], session: FusionSession, withholding: Withholding,
    ) -> None:
        """Take the topic of each role."""
        self._one = {topic.name: _decoder(role, topic.type, session, withholding)
                     for role, topic in topics.items()}
        self._together = {topic.name: (role, topic.type, decode)
                          for role, topic in topics.items()
                          if topic.type in TABLES and role not in withholding.roles
                          and (decode := session.rows_decoder(role)) is not None}
        self.names = frozenset(self._one)

    def decode(self, batch: Sequence[Message]) -> list[Decoded]:
        """Return role and sample, or Refused, of each message in their order."""
        decoded: list[Decoded | None] = [None] * len(batch)
        for name, (role, kind, decode) in self._together.items():
            places = [k for k, message in enumerate(batch) if message[1] == name]
            rows = _rows(kind, [batch[k][2] for k in places])
            for k, sample in zip(places, decode(rows) if rows else (), strict=False):
                decoded[k] = None if sample is None else (role, sample)
        one = self._one
        return [one[name](data, time_ns) if done is None else done
                for (time_ns, name, data), done in zip(batch, decoded, strict=True)]


def _rows(kind: str, messages: Sequence[bytes]) -> FlatRows | None:
    """Return what can be decoded together, None where each message has to be looked at."""
    try:
        return rows_of(kind, messages) if messages else None
    except ValueError:
        return None


def _decoder(
    role: str, kind: str, session: FusionSession, withholding: Withholding,
) -> Callable[[bytes, int], tuple[str, Any]]:
    """Return what turns the bytes of a topic into its role and a sample or Refused."""
    read, decode = reader_of(kind), session.decode
    withheld = role in withholding.roles

    def decoded(data: bytes, log_time_ns: int) -> tuple[str, Any]:
        try:
            message = read(data)
        except Exception as error:
            # Damaged bytes can make the reader raise anything.
            return role, Refused('undecodable', f'{len(data)} bytes are no {kind} ({error})')
        if withheld and withholding.holds(role, _stamp_us(message, log_time_ns)):
            withholding.keep(decode(role, message))
            return role, Refused('withheld', '')
        return role, decode(role, message)

    return decoded


def _stamp_us(message: Any, log_time_ns: int) -> int:
    """Return the stamp of a message, of one without a header the time it was logged."""
    if not isinstance(message, FlatMessage) and not hasattr(message, 'header'):
        return log_time_ns // 1000
    stamp = message if isinstance(message, FlatMessage) else message.header.stamp
    return microseconds(stamp.sec, stamp.nanosec)
