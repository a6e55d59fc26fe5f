"""Reads what can be read of a damaged rosbag2 storage file."""

from __future__ import annotations

from collections.abc import Collection
from collections.abc import Iterator
from dataclasses import dataclass
from dataclasses import field
from pathlib import Path
import struct
from typing import Any
import zlib

from ekf_fusion_ros.replay.compression import zstd
from ekf_fusion_ros.replay.sqlite_pages import leaf_rows

MCAP_MAGIC = b'\x89MCAP0\r\n'
SCHEMA, CHANNEL, MESSAGE, CHUNK, CHUNK_INDEX, FOOTER = 3, 4, 5, 6, 8, 2
LAST_OPCODE = 15


@dataclass(slots=True)
class Salvage:
    """Messages of the wanted types: (log time ns, topic, bytes), sorted by log time.

    `types` maps topic to message type; `losses` says in words what could not be read.
    """

    types: dict[str, str] = field(default_factory=dict)
    messages: list[tuple[int, str, bytes]] = field(default_factory=list)
    losses: list[str] = field(default_factory=list)


def salvage(path: Path, wanted_types: Collection[str]) -> Salvage:
    """Read a damaged .mcap or .db3 file as far as possible; never raises for its content."""
    if path.suffix == '.mcap':
        found = _McapSalvage(path.read_bytes(), wanted_types).run()
    else:
        found = _salvage_db3(path, wanted_types)
    found.messages.sort(key=lambda message: message[0])
    return found


class _McapSalvage:
    """Walks the records of an MCAP file; jumps by the chunk index where one is damaged.

    Record layout: the MCAP specification, https://mcap.dev/spec.
    """

    def __init__(self, data: bytes, wanted_types: Collection[str]) -> None:
        self._data = data
        self._wanted = wanted_types
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, str] = {}
        self._found = Salvage()

    def run(self) -> Salvage:
        if not self._data.startswith(MCAP_MAGIC):
            self._found.losses.append('the file does not begin as an MCAP file does')
            return self._found
        position = len(MCAP_MAGIC)
        while position < len(self._data):
            following = self._record(position)
            if following is None:
                following = self._next_chunk(position)
            if following is None:
                break
            position = following
        return self._found

    def _record(self, position: int) -> int | None:
        """Take in one record and return where the next begins, None where it is damaged."""
        data = self._data
        if len(data) - position < 9:
            self._lose('the file ends within a record')
            return None
        opcode, length = struct.unpack_from('<BQ', data, position)
        start, end = position + 9, position + 9 + length
        if not 0 < opcode <= LAST_OPCODE:
            self._lose(f'no record can be read at byte {position}')
            return None
        if opcode == FOOTER:
            return len(data)
        if end > len(data):
            self._lose('the file ends within a record')
            if opcode != CHUNK:
                return None
        body = data[start:min(end, len(data))]
        try:
            self._take(opcode, body)
        except Exception as error:
            # Damaged bytes can make a decoder raise anything.
            self._lose(f'a record at byte {position} cannot be read ({error})')
        return end if end <= len(data) else None

    def _take(self, opcode: int, body: bytes) -> None:
        if opcode == SCHEMA:
            number, = struct.unpack_from('<H', body)
            self._schemas[number] = _string(body, 2)[0]
        elif opcode == CHANNEL:
            number, schema = struct.unpack_from('<HH', body)
            topic = _string(body, 4)[0]
            self._channels[number] = topic
            self._found.types[topic] = self._schemas.get(schema, '')
        elif opcode == MESSAGE:
            number, _, log_time, _ = struct.unpack_from('<HIQQ', body)
            topic = self._channels[number]
            if self._found.types[topic] in self._wanted:
                self._found.messages.append((log_time, topic, body[22:]))
        elif opcode == CHUNK:
            self._chunk(body)

    def _chunk(self, body: bytes) -> None:
        _, _, size, crc = struct.unpack_from('<QQQI', body)
        compression, at = _string(body, 28)
        raw = _decompressed(compression, body[at + 8:])
        if len(raw) == size and crc and zlib.crc32(raw) != crc:
            raise ValueError('the checksum of a chunk is wrong')
        position = 0
        while position + 9 <= len(raw):
            opcode, length = struct.unpack_from('<BQ', raw, position)
            end = position + 9 + length
            if not 0 < opcode <= LAST_OPCODE or end > len(raw):
                self._lose('a chunk is cut short or damaged')
                return
            self._take(opcode, raw[position + 9:end])
            position = end

    def _next_chunk(self, position: int) -> int | None:
        later = [offset for offset in self._indexed_chunks() if offset > position]
        return min(later) if later else None

    def _indexed_chunks(self) -> Iterator[int]:
        data = self._data
        if not data.endswith(MCAP_MAGIC):
            return
        at, = struct.unpack_from('<Q', data, len(data) - 28)
        while 0 < at <= len(data) - 37:
            opcode, length = struct.unpack_from('<BQ', data, at)
            if opcode == CHUNK_INDEX:
                yield struct.unpack_from('<QQQ', data, at + 9)[2]
            at += 9 + length

    def _lose(self, words: str) -> None:
        if words not in self._found.losses:
            self._found.losses.append(words)


def _string(body: bytes, at: int) -> tuple[str, int]:
    length, = struct.unpack_from('<I', body, at)
    return body[at + 4:at + 4 + length].decode(), at + 4 + length


def _decompressed(compression: str, data: bytes) -> bytes:
    """Return as much of a chunk as its possibly cut data holds."""
    if compression == 'zstd':
        return bytes(zstd.ZstdDecompressor().decompress(data))
    if compression == 'lz4':
        from lz4.frame import LZ4FrameDecompressor
        return bytes(LZ4FrameDecompressor().decompress(data))
    return data


def _salvage_db3(path: Path, wanted_types: Collection[str]) -> Salvage:
    """Collect the rows that look like those of the tables `topics` and `messages`."""
    found = Salvage()
    topics: dict[int, str] = {}
    messages: dict[int, tuple[int, int, bytes]] = {}
    for row, columns in leaf_rows(path):
        if _is_topic(columns):
            topics[row] = columns[1]
            found.types[columns[1]] = columns[2]
        elif _is_message(columns):
            messages.setdefault(row, (columns[2], columns[1], columns[3]))
    for _, (time_ns, topic, data) in sorted(messages.items()):
        if found.types.get(topics.get(topic, '')) in wanted_types:
            found.messages.append((time_ns, topics[topic], data))
    lost = max(messages, default=0) - len(messages)
    if lost:
        found.losses.append(f'{lost} rows cannot be read')
    if not found.types:
        found.losses.append('it holds no table of topics')
    return found


def _is_topic(columns: list[Any]) -> bool:
    return (len(columns) >= 4 and isinstance(columns[1], str) and isinstance(columns[2], str)
            and '/' in columns[2])


def _is_message(columns: list[Any]) -> bool:
    return (len(columns) == 4 and isinstance(columns[1], int) and isinstance(columns[2], int)
            and isinstance(columns[3], bytes))
