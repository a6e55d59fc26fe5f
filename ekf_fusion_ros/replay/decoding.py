"""Messages of a recording to samples, a batch at a time."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterable
from collections.abc import Mapping
from collections.abc import Sequence
from itertools import repeat
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
        self._decoders = {topic.name: _decoder_of_many(role, topic.type, session, withholding)
                          for role, topic in topics.items()}
        self.names = frozenset(self._decoders)

    def decode(self, batch: Sequence[Message]) -> list[Decoded]:
        """Return role and sample, or Refused, of each message in their order."""
        messages: dict[str, list[Message]] = {name: [] for name in self._decoders}
        for message in batch:
            messages[message[1]].append(message)
        decoded = {name: iter(decode(messages[name])) for name, decode in self._decoders.items()}
        return [next(decoded[name]) for _, name, _ in batch]


def _decoder_of_many(
    role: str, kind: str, session: FusionSession, withholding: Withholding,
) -> Callable[[Sequence[Message]], Iterable[Decoded]]:
    """Return what turns messages of a topic into its role and a sample or Refused each."""
    one = _decoder(role, kind, session, withholding)
    decode_rows = session.rows_decoder(role)
    if kind not in TABLES or role in withholding.roles or decode_rows is None:
        return lambda messages: [one(data, time_ns) for time_ns, _, data in messages]

    def decoded(messages: Sequence[Message]) -> Iterable[Decoded]:
        rows = _rows(kind, [data for _, _, data in messages])
        samples = [None] * len(messages) if rows is None else decode_rows(rows)
        if None not in samples:
            return zip(repeat(role), samples)
        return [one(data, time_ns) if sample is None else (role, sample)
                for (time_ns, _, data), sample in zip(messages, samples, strict=True)]

    return decoded


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
