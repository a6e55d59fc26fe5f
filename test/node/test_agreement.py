"""The same recording over DDS and through replay gives the same rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from collections.abc import Iterator
from dataclasses import dataclass
import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('rosbags')
pytest.importorskip('tqdm')

from geometry_msgs.msg import PoseWithCovarianceStamped
from geometry_msgs.msg import TwistWithCovarianceStamped
from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import Odometry
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores
from rosbags.typesys import get_typestore
from sensor_msgs.msg import FluidPressure
from sensor_msgs.msg import Imu
from sensor_msgs.msg import MagneticField
from sensor_msgs.msg import NavSatFix
from sensor_msgs.msg import Range
from std_msgs.msg import Bool

from ekf_fusion_ros.replay import cli as replay
from ekf_fusion_ros.replay.recording import write_recording
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import FigureOfEight

if TYPE_CHECKING:
    from fuser_process import Fuser
    from fuser_process import Peer

pytestmark = pytest.mark.slow
StartFuser = Callable[..., 'Fuser']
Array = NDArray[np.float64]

INPUTS = {
    'odometry': ('odom', Odometry),
    'fix': ('fix', NavSatFix),
    'imu': ('imu', Imu),
    'fix_velocity': ('fix_velocity', TwistWithCovarianceStamped),
    'magnetic_field': ('mag', MagneticField),
    'pressure': ('pressure', FluidPressure),
    'range': ('range', Range),
    'flow': ('flow', Vector3Stamped),
    'airspeed': ('airspeed', TwistWithCovarianceStamped),
    'landed': ('landed', Bool),
    'gps_heading': ('gps_heading', PoseWithCovarianceStamped),
    'aux_velocity': ('aux_velocity', TwistWithCovarianceStamped),
}
IN_FLIGHT = 300
DEPTH = 10000


@dataclass(frozen=True)
class Play:
    """A recording in stamp order, the topic of each role in use, and the estimator."""

    path: Path
    topics: dict[str, str]
    estimator: str = 'ekf2'

    def messages(self) -> Iterator[tuple[str, bytes]]:
        """Yield role and serialised message in the order of the log."""
        roles = {topic: role for role, topic in self.topics.items()}
        with AnyReader([self.path]) as reader:
            wanted = [one for one in reader.connections if one.topic in roles]
            for connection, _, raw in reader.messages(connections=wanted):
                yield roles[connection.topic], bytes(raw)


def simulated(folder: Path, roles: tuple[str, ...], duration: float) -> Path:
    """Write a recording of a figure of eight, in the order of arrival."""
    scenario = Scenario(
        trajectory=FigureOfEight(duration=duration), sensors=default_sensors(roles), seed=5)
    write_recording(folder / 'recording', scenario.arrivals())
    return folder / 'recording'


def cut(source: Path, target: Path, topics: set[str], seconds: float) -> Path:
    """Write the first seconds of a recording in the order of header stamps."""
    store = get_typestore(Stores.ROS2_JAZZY)
    rows = []
    with AnyReader([source], default_typestore=store) as reader:
        wanted = [one for one in reader.connections if one.topic in topics]
        last = reader.start_time + int(1e9 * seconds)
        for connection, _, raw in reader.messages(connections=wanted, stop=last):
            stamp = store.deserialize_cdr(raw, connection.msgtype).header.stamp
            time_ns = stamp.sec * 10**9 + stamp.nanosec
            rows.append((time_ns, connection.topic, connection.msgtype, raw))
    rows.sort(key=lambda row: row[:2])
    with Writer(target, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        connections = {
            topic: bag.add_connection(topic, kind, typestore=store)
            for topic, kind in {(topic, kind) for _, topic, kind, _ in rows}}
        for time_ns, topic, _, raw in rows:
            bag.write(connections[topic], time_ns, raw)
    return target


def rows_of_replay(play: Play, folder: Path) -> dict[int, Array]:
    """Replay and return x, y, z, qx, qy, qz, qw, vx, vy, vz, yaw, 4 variances by stamp in us."""
    chosen = [f'--topic={role}={topic}' for role, topic in play.topics.items()]
    arguments = [str(play.path), '--output', str(folder), '--rate', '0', '--no-bag',
                 '--estimator', play.estimator, *chosen]
    assert replay.main(arguments) == 0
    lines = (folder / 'trajectory.csv').read_text().splitlines()[1:]
    table = [line.split(',') for line in lines]
    return {int(row[0].replace('.', '')): np.array(row[1:], dtype=float) for row in table}


def rows_of_node(
    play: Play, start_fuser: StartFuser, peer: Peer, last_us: int,
) -> list[Odometry]:
    """Publish a recording into a node and return what it says, up to a stamp."""
    parameters = {'node.publish_every_update': True, 'estimator': play.estimator}
    for role, topic in play.topics.items():
        parameters[f'node.use_{role}'] = True
        parameters[f'qos_overrides.{topic}.subscription.depth'] = DEPTH
    # One odometry message can make ten rows: a reliable writer keeps no more than its depth.
    for output in ('/odometry/filtered', '/odometry/gps', '/gps/filtered'):
        parameters[f'qos_overrides.{output}.publisher.depth'] = DEPTH
    parameters['node.use_odometry'] = 'odometry' in play.topics
    names = {INPUTS[role][0]: topic for role, topic in play.topics.items()}
    fuser = start_fuser(parameters, names)
    peer.connect(fuser, {topic: INPUTS[role][1] for role, topic in play.topics.items()})
    sent: Counter[str] = Counter()
    for role, raw in play.messages():
        peer.until(lambda: in_flight(sent, peer) < IN_FLIGHT, fuser)
        peer.publish(play.topics[role], raw)
        sent[role] += 1
    peer.until(lambda: in_flight(sent, peer) == 0, fuser)
    for heard in (peer.odometry, peer.fixes):
        peer.until(lambda heard=heard: bool(heard) and stamp_us(heard[-1]) >= last_us, fuser)
    return peer.odometry


def in_flight(sent: Counter[str], peer: Peer) -> int:
    """Return the number of messages of which the node has not told yet."""
    return sum(sent.values()) - sum(peer.count(role) for role in sent)


def stamp_us(message: Odometry | NavSatFix) -> int:
    """Return a header stamp, which the node gives in whole microseconds."""
    stamp = message.header.stamp
    assert stamp.nanosec % 1000 == 0
    return stamp.sec * 10**6 + stamp.nanosec // 1000


def as_row(message: Odometry) -> Array:
    """Return the columns of trajectory.csv but the yaw."""
    pose, linear = message.pose.pose, message.twist.twist.linear
    turn = pose.orientation
    x, y, z, w = turn.x, turn.y, turn.z, turn.w
    to_world = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
    velocity = to_world @ [linear.x, linear.y, linear.z]
    variances = np.array(message.pose.covariance)[[0, 7, 14, 35]]
    place = pose.position
    return np.array([place.x, place.y, place.z, x, y, z, w, *velocity, *variances])


def assert_same(rows: dict[int, Array], messages: list[Odometry]) -> None:
    """Assert that every row came over DDS, once and in order, and equal to 1e-9."""
    assert [stamp_us(message) for message in messages] == list(rows)
    replayed = np.array([np.delete(row, 10) for row in rows.values()])
    published = np.array([as_row(message) for message in messages])
    np.testing.assert_allclose(published, replayed, rtol=0, atol=1e-9)


INERTIAL = {
    'fix': '/fix', 'fix_velocity': '/fix_velocity', 'imu': '/imu/data_raw',
    'magnetic_field': '/mag', 'pressure': '/pressure'}


FURTHER = {
    'range': '/range', 'flow': '/flow', 'airspeed': '/airspeed', 'landed': '/landed',
    'gps_heading': '/gps_heading', 'aux_velocity': '/aux_velocity'}


@pytest.mark.parametrize(
    'topics', [INERTIAL, {**INERTIAL, 'odometry': '/odom'}, {**INERTIAL, **FURTHER}],
    ids=['inertial', 'with odometry', 'further roles'])
def test_simulated_flight(
    tmp_path: Path, start_fuser: StartFuser, peer: Peer, topics: dict[str, str],
) -> None:
    roles = tuple(role for role in topics if role != 'fix_velocity')
    play = Play(simulated(tmp_path, roles, 25.0), topics)
    rows = rows_of_replay(play, tmp_path / 'out')
    assert len(rows) > 500
    assert_same(rows, rows_of_node(play, start_fuser, peer, max(rows)))


def test_the_other_estimator(tmp_path: Path, start_fuser: StartFuser, peer: Peer) -> None:
    roles = tuple(role for role in INERTIAL if role != 'fix_velocity')
    play = Play(simulated(tmp_path, roles, 12.0), INERTIAL, estimator='lpe')
    rows = rows_of_replay(play, tmp_path / 'out')
    assert len(rows) > 500
    assert_same(rows, rows_of_node(play, start_fuser, peer, max(rows)))


def test_two_topics(tmp_path: Path, start_fuser: StartFuser, peer: Peer) -> None:
    play = Play(simulated(tmp_path, ('odometry', 'fix'), 60.0),
                {'odometry': '/odom', 'fix': '/fix'})
    rows = rows_of_replay(play, tmp_path / 'out')
    assert len(rows) > 500
    assert_same(rows, rows_of_node(play, start_fuser, peer, max(rows)))


def test_real_drive(
    tmp_path: Path, shared: Path, start_fuser: StartFuser, peer: Peer,
) -> None:
    pymap3d = pytest.importorskip('pymap3d')
    topics = {'odometry': '/husky_velocity_controller/odom', 'fix': '/fix'}
    recording = cut(shared / 'data' / 'rl_husky' / 'rl_husky_mcap', tmp_path / 'cut',
                    set(topics.values()), 90.0)
    play = Play(recording, topics)
    rows = rows_of_replay(play, tmp_path / 'out')
    assert len(rows) > 100
    assert_same(rows, rows_of_node(play, start_fuser, peer, max(rows)))
    origin = json.loads((tmp_path / 'out' / 'summary.json').read_text())['origin']
    assert len(peer.fixes) == len(rows)
    lat, lon, alt = (origin[key] for key in ('lat', 'lon', 'alt'))
    for fix, row in zip(peer.fixes, rows.values(), strict=True):
        east, north, _ = pymap3d.geodetic2enu(fix.latitude, fix.longitude, alt, lat, lon, alt)
        assert abs(east - row[0]) < 0.01
        assert abs(north - row[1]) < 0.01
    assert len(peer.gps) > 10
    assert all(message.header.frame_id == 'map' for message in peer.gps)
