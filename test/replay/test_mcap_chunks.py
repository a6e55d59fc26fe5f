"""Messages read chunk by chunk against those that the rosbags library reads."""

from __future__ import annotations

import numpy as np
import pytest

rosbag2 = pytest.importorskip('rosbags.rosbag2')
typesys = pytest.importorskip('rosbags.typesys')
storage = pytest.importorskip('ekf_fusion_ros.replay.storage')
mcap_chunks = pytest.importorskip('ekf_fusion_ros.replay.mcap_chunks')

STORE = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
RNG = np.random.default_rng(5)
KINDS = {'/imu': 'sensor_msgs/msg/Imu', '/fix': 'sensor_msgs/msg/NavSatFix',
         '/odom': 'nav_msgs/msg/Odometry'}
# A chunk of the library closes at a mebibyte.
COUNT, SIZE = 40, 100_000


def write(path, times, compressed):
    bag = rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin.MCAP)
    if compressed:
        bag.set_compression(rosbag2.CompressionMode.STORAGE, rosbag2.CompressionFormat.ZSTD)
    with bag:
        connections = [bag.add_connection(topic, kind, typestore=STORE)
                       for topic, kind in KINDS.items()]
        for number, time_ns in enumerate(times):
            data = RNG.integers(0, 4, SIZE, dtype=np.uint8).tobytes()
            bag.write(connections[number % 3], int(time_ns), data)
    return path / f'{path.name}.mcap'


def as_rosbags_reads(path):
    with rosbag2.Reader(path) as bag:
        wanted = [one for one in bag.connections if one.topic != '/fix']
        return [(time_ns, one.topic, bytes(data)) for one, time_ns, data in bag.messages(wanted)]


def as_we_read(path):
    with storage.Recording(path, frozenset(KINDS.values())) as recording:
        return list(recording.messages(['/imu', '/odom'])), recording.notes


@pytest.mark.parametrize('compressed', [False, True])
@pytest.mark.parametrize('disorder_ns', [0, 3_000, 10**9])
def test_messages_are_those_of_the_library(tmp_path, compressed, disorder_ns):
    times = 10**12 + 10_000 * (np.arange(COUNT) // 2)
    times[1::7] -= disorder_ns
    path = write(tmp_path / 'bag', times, compressed)
    assert bool(mcap_chunks.chunks_in_order(path)) == (disorder_ns < 10**6)
    messages, notes = as_we_read(path)
    assert notes == []
    assert messages == as_rosbags_reads(path)


def test_a_damaged_chunk_is_told(tmp_path):
    path = write(tmp_path / 'bag', 10**12 + 10_000 * np.arange(COUNT), compressed=True)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    messages, notes = as_we_read(path)
    assert 0 < len(messages) < 2 * COUNT // 3
    assert 'damaged' in notes[0]
