"""rosbag2 recordings in every storage, intact or damaged, as one stream by log time."""

from __future__ import annotations

from collections.abc import Collection
from collections.abc import Iterator
from dataclasses import dataclass
import heapq
from itertools import chain
from itertools import islice
from operator import itemgetter
from pathlib import Path
import shutil
from tempfile import TemporaryDirectory

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader
import yaml

from ekf_fusion_ros.replay.compression import zstd
from ekf_fusion_ros.replay.mcap_chunks import chunk_messages
from ekf_fusion_ros.replay.mcap_chunks import chunks_in_order
from ekf_fusion_ros.replay.salvage import Salvage
from ekf_fusion_ros.replay.salvage import salvage

ZSTD_MAGIC = b'\x28\xb5\x2f\xfd'
_DATA, _FIRST_FOUR = itemgetter(2), itemgetter(slice(4))
BLOCK = 256
# libyaml, where it is built in, takes a tenth of the time.
LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
SUFFIXES = ('.mcap', '.db3', '.mcap.zstd', '.db3.zstd')
Message = tuple[int, str, bytes]


class RecordingError(Exception):
    """A recording cannot be used; the text is one sentence that names the file."""


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic of a recording."""

    name: str
    type: str
    count: int


class Recording:
    """An open rosbag2 recording.

    start_ns, end_ns: earliest and latest log time over all topics. `notes` says in sentences
    what is damaged; it grows while messages are read. Raises RecordingError where nothing can
    be read.
    """

    def __init__(self, path: Path, wanted_types: Collection[str]) -> None:
        self.path = path
        self.notes: list[str] = []
        self._wanted = frozenset(wanted_types)
        self._scratch = TemporaryDirectory(prefix='ekf_fusion_ros_')
        files, first_ns = self._files()
        self._parts = [part for part in map(self._open, files) if part is not None]
        if not any(part.topics for part in self._parts):
            self.close()
            raise RecordingError(self._unusable())
        self.topics = self._merged_topics()
        starts = [part.start_ns for part in self._parts if part.start_ns is not None]
        ends = [part.end_ns for part in self._parts if part.end_ns is not None]
        if not starts:
            self.close()
            raise RecordingError('; '.join([f'{path}: holds no messages', *self.notes]))
        self.start_ns = min(starts) if first_ns is None else min(first_ns, *starts)
        self.end_ns = max(ends)

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield (log time ns, topic, CDR bytes) of these topics by log time."""
        streams = [chain.from_iterable(map(_plain, part.blocks(frozenset(topics), self.notes)))
                   for part in self._parts]
        return streams[0] if len(streams) == 1 else heapq.merge(*streams, key=itemgetter(0))

    def close(self) -> None:
        """Release files."""
        for part in getattr(self, '_parts', []):
            part.close()
        self._scratch.cleanup()

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _unusable(self) -> str:
        reasons = '; '.join(self.notes) or 'it holds no storage file'
        return f'{self.path}: cannot be read as a rosbag2 recording: {reasons}'

    def _files(self) -> tuple[list[Path], int | None]:
        """Return the storage files in order, and the start that the metadata gives."""
        if not self.path.exists():
            raise RecordingError(f'{self.path}: does not exist')
        if not self.path.is_dir():
            if not self.path.name.endswith(SUFFIXES):
                raise RecordingError(f'{self.path}: not a rosbag2 recording: expected a folder '
                                     f'or a file ending in {", ".join(SUFFIXES)}')
            return [self.path], None
        present = sorted(p for p in self.path.iterdir() if p.name.endswith(SUFFIXES))
        if not present and not (self.path / 'metadata.yaml').exists():
            raise RecordingError(f'{self.path}: not a rosbag2 recording: the folder holds no file '
                                 f'ending in {", ".join(SUFFIXES)}')
        try:
            text = (self.path / 'metadata.yaml').read_text(encoding='utf-8')
            about = yaml.load(text, LOADER)['rosbag2_bagfile_information']
            names = [Path(name).name for name in about['relative_file_paths']]
            start = about['starting_time']['nanoseconds_since_epoch']
            count = about['message_count']
        except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError) as error:
            reason = error.strerror if isinstance(error, OSError) else _words(error)
            self.notes.append(f'metadata.yaml cannot be used ({reason}); the storage files are '
                              'read without it')
            return present, None
        for name in names:
            if not (self.path / name).exists():
                self.notes.append(f'{name} is named in metadata.yaml and missing')
        listed = [self.path / name for name in names if (self.path / name).exists()]
        return listed or present, int(start) if count else None

    def _open(self, path: Path) -> _Part | None:
        if path.stat().st_size == 0:
            self.notes.append(f'{path.name} is empty')
            return None
        try:
            storage = self._unpacked(path)
        except Exception as error:
            # A damaged archive can make the decompressor raise anything.
            self.notes.append(f'{path.name} cannot be decompressed ({_words(error)})')
            return None
        reader = Reader(storage)
        try:
            reader.open()
        except Exception as error:
            # Damaged bytes can make the library raise anything.
            return self._salvaged(storage, error)
        return _IntactPart(storage, reader, self._wanted)

    def _salvaged(self, storage: Path, error: Exception) -> _Part:
        found = salvage(storage, self._wanted)
        self.notes.append(_damage(storage, error, found))
        return _SalvagedPart(found)

    def _unpacked(self, path: Path) -> Path:
        if path.suffix != '.zstd':
            return path
        storage = Path(self._scratch.name) / path.stem
        with path.open('rb') as packed, storage.open('wb') as plain:
            try:
                with zstd.open(packed, 'rb') as unpacked:
                    shutil.copyfileobj(unpacked, plain)
            except (EOFError, zstd.ZstdError):
                # Cut short: what is there is salvaged.
                if plain.tell() == 0:
                    raise
        return storage

    def _merged_topics(self) -> dict[str, Topic]:
        merged: dict[str, Topic] = {}
        for part in self._parts:
            for topic in part.topics:
                before = merged.get(topic.name)
                count = topic.count + (before.count if before else 0)
                merged[topic.name] = Topic(topic.name, topic.type, count)
        return dict(sorted(merged.items()))


class _Part:
    """One storage file."""

    topics: list[Topic]
    start_ns: int | None = None
    end_ns: int | None = None

    def blocks(self, topics: frozenset[str], notes: list[str]) -> Iterator[list[Message]]:
        """Yield the messages of these topics by log time, many at a time."""
        raise NotImplementedError

    def close(self) -> None:
        """Release the file."""


class _IntactPart(_Part):
    """A file that the library can open; salvaged from where it fails later."""

    def __init__(self, storage: Path, reader: Reader, wanted: frozenset[str]) -> None:
        self._storage, self._reader, self._wanted = storage, reader, wanted
        counts: dict[tuple[str, str], int] = {}
        for one in reader.connections:
            key = (one.topic, one.msgtype)
            counts[key] = counts.get(key, 0) + one.msgcount
        self.topics = [Topic(*key, count) for key, count in counts.items()]
        if reader.message_count:
            self.start_ns, self.end_ns = reader.start_time, reader.end_time - 1

    def blocks(self, topics: frozenset[str], notes: list[str]) -> Iterator[list[Message]]:
        connections = [one for one in self._reader.connections if one.topic in topics]
        last, missing = -1, sum(one.msgcount for one in connections)
        try:
            for block in self._read(connections) if connections else ():
                yield block
                missing -= len(block)
                last = block[-1][0] if block else last
            if missing > 0:
                notes.append(f'{self._storage.name} is damaged: {missing} messages that it counts '
                             'cannot be read')
            return
        except Exception as error:
            # Damaged bytes can make the library raise anything.
            found = salvage(self._storage, self._wanted)
            notes.append(_damage(self._storage, error, found))
        yield [message for message in found.messages
               if message[0] > last and message[1] in topics]

    def _read(self, connections: list[Connection]) -> Iterator[list[Message]]:
        if self._storage.suffix == '.mcap':
            chunks = chunks_in_order(self._storage)
            if chunks:
                topics = {one.id: one.topic for one in connections}
                return chunk_messages(self._storage, chunks, topics)
        messages = ((time_ns, one.topic, data)
                    for one, time_ns, data in self._reader.messages(connections))
        return iter(lambda: list(islice(messages, BLOCK)), [])

    def close(self) -> None:
        self._reader.close()


class _SalvagedPart(_Part):
    """What a damaged file still holds."""

    def __init__(self, found: Salvage) -> None:
        self._found = found
        counts = dict.fromkeys(found.types, 0)
        for _, topic, _ in found.messages:
            counts[topic] += 1
        self.topics = [Topic(name, found.types[name], count) for name, count in counts.items()]
        if found.messages:
            self.start_ns, self.end_ns = found.messages[0][0], found.messages[-1][0]

    def blocks(self, topics: frozenset[str], notes: list[str]) -> Iterator[list[Message]]:
        yield [message for message in self._found.messages if message[1] in topics]


def _plain(block: list[Message]) -> list[Message]:
    """Return messages decompressed where they are compressed one by one."""
    # in C from end to end, as nearly all recordings take this way
    if ZSTD_MAGIC not in map(_FIRST_FOUR, map(_DATA, block)):
        return block
    return [(time_ns, topic, _decompressed(data) if data.startswith(ZSTD_MAGIC) else data)
            for time_ns, topic, data in block]


def _decompressed(data: bytes) -> bytes:
    """Decompress a message; what cannot be decompressed is left, for the decoder to refuse."""
    try:
        return bytes(zstd.decompress(data))
    except (EOFError, zstd.ZstdError):
        return data


def _damage(path: Path, error: Exception, found: Salvage) -> str:
    reason = _words(error).replace(str(path), path.name)
    losses = '; '.join([reason, *found.losses])
    if not found.messages:
        return f'nothing can be read from {path.name} ({losses})'
    return (f'{path.name} is damaged and replayed as far as it can be read, '
            f'{len(found.messages)} messages ({losses})')


def _words(error: BaseException) -> str:
    lines = str(error).strip().rstrip('.').splitlines()
    return lines[0] if lines else type(error).__name__
