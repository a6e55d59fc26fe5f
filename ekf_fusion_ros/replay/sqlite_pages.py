"""Table rows straight from the pages of an SQLite file, for files too damaged to open.

A truncated database loses the inner pages of its trees, through which every query goes, while the
leaf pages that hold the rows are still there. Format: https://www.sqlite.org/fileformat2.html.
"""

from __future__ import annotations

from collections.abc import Iterator
import mmap
from pathlib import Path
import struct
from typing import Any

MAGIC = b'SQLite format 3\x00'
LEAF_TABLE = 0x0D
INTEGER_SIZES = {1: 1, 2: 2, 3: 3, 4: 4, 5: 6, 6: 8}


def leaf_rows(path: Path) -> Iterator[tuple[int, list[Any]]]:
    """Yield (row number, columns) of every row on a leaf page, in the order of the pages.

    Columns are None, int, float, str or bytes. Rows that reach into missing pages are left out;
    a file that is no database has no rows.
    """
    if path.stat().st_size < 512:
        return
    with path.open('rb') as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        if data[:16] != MAGIC:
            return
        pages = _Pages(data)
        for number in range(1, pages.count + 1):
            yield from pages.rows(number)


class _Pages:
    """The whole pages of a file; a part of a page at its end is left out."""

    def __init__(self, data: Any) -> None:
        size, = struct.unpack('>H', data[16:18])
        self._size: int = 65536 if size == 1 else max(size, 512)
        self._usable: int = self._size - data[20]
        self._data = data
        self.count = len(data) // self._size

    def rows(self, number: int) -> Iterator[tuple[int, list[Any]]]:
        page = self._page(number)
        head = 100 if number == 1 else 0
        if page[head] != LEAF_TABLE:
            return
        cells, = struct.unpack_from('>H', page, head + 3)
        for index in range(min(cells, self._size // 4)):
            try:
                at, = struct.unpack_from('>H', page, head + 8 + 2 * index)
                length, at = _varint(page, at)
                row, at = _varint(page, at)
                columns = _columns(self._payload(page, at, length))
            except (IndexError, ValueError, struct.error):
                # A damaged cell, or one that reaches into a missing page.
                continue
            yield row, columns

    def _page(self, number: int) -> bytes:
        if not 0 < number <= self.count:
            raise IndexError(number)
        return bytes(self._data[(number - 1) * self._size:number * self._size])

    def _payload(self, page: bytes, at: int, length: int) -> bytes:
        """Return the whole payload of a cell, from its overflow pages too."""
        if length > len(self._data):
            raise ValueError(length)
        local = self._local(length)
        parts, left = [page[at:at + local]], length - local
        if left:
            following, = struct.unpack_from('>I', page, at + local)
        while left:
            overflow = self._page(following)
            following, = struct.unpack_from('>I', overflow)
            parts.append(overflow[4:4 + min(left, self._usable - 4)])
            left -= len(parts[-1])
        return b''.join(parts)

    def _local(self, length: int) -> int:
        """Return how much of a payload stands on the leaf page itself."""
        if length <= self._usable - 35:
            return length
        least = (self._usable - 12) * 32 // 255 - 23
        most = least + (length - least) % (self._usable - 4)
        return most if most <= self._usable - 35 else least


def _varint(data: bytes, at: int) -> tuple[int, int]:
    value: int = 0
    for step in range(8):
        byte = data[at + step]
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, at + step + 1
    return value << 8 | data[at + 8], at + 9


def _columns(payload: bytes) -> list[Any]:
    """Decode a record."""
    end, at = _varint(payload, 0)
    kinds = []
    while at < end:
        kind, at = _varint(payload, at)
        kinds.append(kind)
    columns = []
    at = end
    for kind in kinds:
        size = _size_of(kind)
        if at + size > len(payload):
            raise ValueError(kind)
        columns.append(_value(kind, payload[at:at + size]))
        at += size
    return columns


def _size_of(kind: int) -> int:
    if kind >= 12:
        return int(kind - 12) // 2
    return 8 if kind == 7 else INTEGER_SIZES.get(kind, 0)


def _value(kind: int, data: bytes) -> Any:
    if kind >= 12:
        return data.decode() if kind % 2 else data
    if kind in INTEGER_SIZES:
        return int.from_bytes(data, 'big', signed=True)
    if kind == 7:
        return struct.unpack('>d', data)[0]
    return {8: 0, 9: 1}.get(kind)
