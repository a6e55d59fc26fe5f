"""Messages of an intact MCAP file, chunk by chunk, at a third of the cost of a general reader.

Record layout: the MCAP specification, https://mcap.dev/spec.
"""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Mapping
from itertools import pairwise
import mmap
from operator import itemgetter
from pathlib import Path
import struct
from typing import BinaryIO
import zlib

from ekf_fusion_ros.replay.compression import zstd

MESSAGE, CHUNK_INDEX = 5, 8
FOOTER_SIZE = 37
_HEAD = struct.Struct('<BQ').unpack_from
_LENGTH = struct.Struct('<Q').unpack_from
_MESSAGE = struct.Struct('<QH4xQ').unpack_from
"""Length of the record, channel and log time."""
_SIZES, _STORED = struct.Struct('<QII'), struct.Struct('<Q')


def chunks_in_order(path: Path) -> list[int]:
    """Return where the chunks of a file begin; empty where they are not one after the other.

    Only such a file can be read chunk by chunk. Raises struct.error for damaged bytes.
    """
    with path.open('rb') as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        index = sorted(_index(data))
    ordered = all(before[1] <= after[0] for before, after in pairwise(index))
    return [offset for _, _, offset in index] if ordered else []


def chunk_messages(
    path: Path, chunks: list[int], topics: Mapping[int, str],
) -> Iterator[list[tuple[int, str, bytes]]]:
    """Yield (log time ns, topic, bytes) of the channels in `topics`, by log time, chunk by chunk.

    Raises ValueError, struct.error or an error of the decompressor for a damaged chunk.
    """
    # Read, not mapped: mapped pages would count as memory of the process until the end.
    with path.open('rb') as stream:
        for offset in chunks:
            yield sorted(_messages(_records(stream, offset), topics), key=itemgetter(0))


def _index(data: mmap.mmap) -> Iterator[tuple[int, int, int]]:
    """Yield first and last log time and the offset of each chunk."""
    at, = struct.unpack_from('<Q', data, len(data) - 28)
    while 0 < at < len(data) - FOOTER_SIZE:
        opcode, length = _HEAD(data, at)
        if opcode == CHUNK_INDEX:
            yield struct.unpack_from('<QQQ', data, at + 9)
        at += 9 + length


def _records(stream: BinaryIO, offset: int) -> bytes:
    """Return the records of a chunk, decompressed and checked."""
    stream.seek(offset + 9 + 16)
    size, crc, name_length = _SIZES.unpack(stream.read(_SIZES.size))
    compression = stream.read(name_length).decode()
    stored, = _STORED.unpack(stream.read(_STORED.size))
    raw = _decompressed(compression, stream.read(stored))
    if len(raw) != size:
        raise ValueError(f'a chunk holds {len(raw)} bytes instead of {size}')
    if crc and zlib.crc32(raw) != crc:
        raise ValueError('the checksum of a chunk is wrong')
    return raw


def _decompressed(compression: str, data: bytes) -> bytes:
    if compression == 'zstd':
        return bytes(zstd.decompress(data))
    if compression == 'lz4':
        from lz4.frame import decompress
        return bytes(decompress(data))
    if compression:
        raise ValueError(f'the compression {compression!r} of a chunk is not known')
    return data


def _messages(raw: bytes, topics: Mapping[int, str]) -> list[tuple[int, str, bytes]]:
    found = []
    at, size = 0, len(raw)
    while at < size:
        begin, opcode = at, raw[at]
        if opcode == MESSAGE:
            length, channel, log_time = _MESSAGE(raw, at + 1)
            at += 9 + length
            topic = topics.get(channel)
            if topic is not None:
                found.append((log_time, topic, raw[begin + 31:at]))
        else:
            at += 9 + _LENGTH(raw, at + 1)[0]
    if at > size:
        raise ValueError('a record of a chunk is cut short')
    return found
