"""Recordings in every storage, intact and damaged."""

from __future__ import annotations

import shutil
import struct

import numpy as np
import pytest

pytest.importorskip('rosbags')
from rosbags.rosbag2 import CompressionFormat
from rosbags.rosbag2 import CompressionMode
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores
from rosbags.typesys import get_typestore

from ekf_fusion_ros.replay.storage import Recording
from ekf_fusion_ros.replay.storage import RecordingError
from ekf_fusion_ros.replay.topics import ALL_TYPES

STORE = get_typestore(Stores.ROS2_JAZZY)
PRESSURE = 'sensor_msgs/msg/FluidPressure'
COUNT = 4000
STORAGES = {
    'mcap': (StoragePlugin.MCAP, None),
    'mcap_zstd': (StoragePlugin.MCAP, CompressionMode.STORAGE),
    'db3': (StoragePlugin.SQLITE3, None),
    'db3_zstd_file': (StoragePlugin.SQLITE3, CompressionMode.FILE),
    'db3_zstd_message': (StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
}


def pressure(number):
    """Return CDR of a message that carries its number; padded so that chunks fill."""
    types = STORE.types
    padding = np.random.default_rng(number).integers(33, 127, 700, dtype=np.uint8)
    stamp = types['builtin_interfaces/msg/Time'](sec=1 + number // 100, nanosec=0)
    header = types['std_msgs/msg/Header'](stamp=stamp, frame_id=padding.tobytes().decode())
    message = types[PRESSURE](header=header, fluid_pressure=float(number), variance=0.0)
    return STORE.serialize_cdr(message, PRESSURE)


def write(path, storage):
    plugin, mode = STORAGES[storage]
    with_compression = Writer(path, version=9, storage_plugin=plugin)
    if mode is not None:
        with_compression.set_compression(mode, CompressionFormat.ZSTD)
    with with_compression as bag:
        wanted = bag.add_connection('/pressure', PRESSURE, typestore=STORE)
        other = bag.add_connection('/text', 'std_msgs/msg/String', typestore=STORE)
        text = STORE.serialize_cdr(STORE.types['std_msgs/msg/String'](data='x'),
                                   'std_msgs/msg/String')
        bag.write(other, 999_000_000, text)
        for number in range(COUNT):
            bag.write(wanted, 1_000_000_000 + number * 10_000_000, pressure(number))
    return path


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp('bags')
    return {storage: write(folder / storage, storage) for storage in STORAGES}


def storage_file(folder):
    return next(path for path in folder.iterdir() if path.name != 'metadata.yaml')


def numbers(recording):
    """Return the numbers of the messages that can be decoded, in order."""
    found = []
    for _, topic, data in recording.messages(['/pressure']):
        assert topic == '/pressure'
        try:
            found.append(int(STORE.deserialize_cdr(data, PRESSURE).fluid_pressure))
        except Exception:
            found.append(None)
    return found


@pytest.mark.parametrize('storage', STORAGES)
def test_every_storage_gives_every_message(bags, storage):
    with Recording(bags[storage], ALL_TYPES) as recording:
        assert recording.start_ns == 999_000_000
        assert recording.end_ns == 1_000_000_000 + (COUNT - 1) * 10_000_000
        assert {name: topic.count for name, topic in recording.topics.items()} == {
            '/pressure': COUNT, '/text': 1}
        assert numbers(recording) == list(range(COUNT))
        assert recording.notes == []


@pytest.mark.parametrize('storage', STORAGES)
def test_file_without_its_folder(bags, storage):
    with Recording(storage_file(bags[storage]), ALL_TYPES) as recording:
        assert numbers(recording) == list(range(COUNT))


@pytest.mark.parametrize('storage', STORAGES)
@pytest.mark.parametrize('metadata', [None, 'rosbag2_bagfile_information: {version: 5', 'x: 1'])
def test_metadata_missing_or_damaged(bags, tmp_path, storage, metadata):
    folder = tmp_path / 'bag'
    shutil.copytree(bags[storage], folder)
    (folder / 'metadata.yaml').unlink()
    if metadata is not None:
        (folder / 'metadata.yaml').write_text(metadata)
    with Recording(folder, ALL_TYPES) as recording:
        assert numbers(recording) == list(range(COUNT))
        assert len(recording.notes) == 1 and 'metadata.yaml' in recording.notes[0]


@pytest.mark.parametrize('storage', ['mcap', 'mcap_zstd', 'db3', 'db3_zstd_file'])
@pytest.mark.parametrize('share', [0.3, 0.6, 0.95])
def test_truncated_is_read_as_far_as_it_goes(bags, tmp_path, storage, share):
    source = storage_file(bags[storage])
    data = source.read_bytes()
    cut = tmp_path / source.name
    cut.write_bytes(data[:int(share * len(data))])
    with Recording(cut, ALL_TYPES) as recording:
        found = numbers(recording)
        assert found == sorted(set(found))
        assert found[0] == 0 and found[-1] < COUNT
        assert len(found) > (share - 0.25) * COUNT
        assert any('damaged' in note for note in recording.notes)


@pytest.mark.parametrize('storage', ['mcap', 'mcap_zstd', 'db3'])
def test_garbage_in_the_middle_costs_only_its_surroundings(bags, tmp_path, storage):
    source = storage_file(bags[storage])
    data = bytearray(source.read_bytes())
    middle = len(data) // 2
    data[middle:middle + 5000] = np.random.default_rng(3).bytes(5000)
    spoiled = tmp_path / source.name
    spoiled.write_bytes(bytes(data))
    with Recording(spoiled, ALL_TYPES) as recording:
        found = [number for number in numbers(recording) if number is not None]
        inside = [number for number in found if 0 <= number < COUNT]
        assert len(inside) > 0.5 * COUNT
        assert inside[0] == 0 and inside[-1] == COUNT - 1
        assert any('damaged' in note for note in recording.notes)


@pytest.mark.parametrize('suffix', ['.mcap', '.db3', '.db3.zstd'])
@pytest.mark.parametrize('content', [b'', b'\x00' * 1000, b'not a recording at all' * 50])
def test_foreign_or_empty_files_are_refused_in_one_sentence(tmp_path, suffix, content):
    path = tmp_path / f'flight{suffix}'
    path.write_bytes(content)
    with pytest.raises(RecordingError) as caught:
        Recording(path, ALL_TYPES)
    assert 'flight' in str(caught.value)
    assert '\n' not in str(caught.value)


def test_missing_and_unknown(tmp_path):
    with pytest.raises(RecordingError, match='does not exist'):
        Recording(tmp_path / 'none', ALL_TYPES)
    with pytest.raises(RecordingError, match='holds no file'):
        Recording(tmp_path, ALL_TYPES)
    (tmp_path / 'flight.bag').write_bytes(b'#ROSBAG V2.0\n')
    with pytest.raises(RecordingError, match=r'\.mcap'):
        Recording(tmp_path / 'flight.bag', ALL_TYPES)


def test_a_split_recording_is_one_stream(bags, tmp_path):
    folder = tmp_path / 'split'
    folder.mkdir()
    shutil.copy(storage_file(bags['mcap']), folder / 'a_0.mcap')
    shutil.copy(storage_file(bags['db3']), folder / 'a_1.db3')
    with Recording(folder, ALL_TYPES) as recording:
        assert recording.topics['/pressure'].count == 2 * COUNT
        times = [time_ns for time_ns, _, _ in recording.messages(['/pressure'])]
    assert len(times) == 2 * COUNT
    assert times == sorted(times)


def test_a_message_cut_short_is_left_to_the_decoder(tmp_path):
    with Writer(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        wanted = bag.add_connection('/pressure', PRESSURE, typestore=STORE)
        bag.write(wanted, 1, pressure(1)[:20])
        bag.write(wanted, 2, struct.pack('<4B', 0, 1, 0, 0))
        bag.write(wanted, 3, pressure(3))
    with Recording(tmp_path / 'bag', ALL_TYPES) as recording:
        assert numbers(recording) == [None, None, 3]
