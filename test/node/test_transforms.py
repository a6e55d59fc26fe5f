"""TF of the node: which transform, its value, and when none is published."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
import math
from typing import TYPE_CHECKING
from typing import Any

import numpy as np
import pytest

rclpy = pytest.importorskip('rclpy')

from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import NavSatFix
from test_fuser import fix
from test_fuser import odometry

from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.frames import swap_attitude
from ekf_fusion_ros.frames import swap_enu_ned
from ekf_fusion_ros.mathlib.rigid import Pose
from ekf_fusion_ros.mathlib.rigid import compose
from ekf_fusion_ros.mathlib.rigid import interpolate
from ekf_fusion_ros.node.transforms import Transforms
from ekf_fusion_ros.node.transforms import check_frames
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.session import FusionSession

if TYPE_CHECKING:
    from fuser_process import Fuser
    from fuser_process import Peer

StartFuser = Callable[..., 'Fuser']
HAS_TF = find_spec('tf2_msgs') is not None


class Bench:
    """Transforms whose messages and warnings are kept."""

    def __init__(self, **values: Any) -> None:
        self.sent: list[TransformStamped] = []
        self.warned: list[str] = []
        changes = {f'node.{name}': value for name, value in values.items()}
        params = with_overrides(Params(), changes)
        self.transforms = Transforms(
            params, lambda: params.messages.odometry, self.sent.extend, self.warned.append)


def state(time_us: int, position: tuple[float, ...], yaw: float) -> NavState:
    """Return a state at a place (ENU, m) with a yaw (ENU, rad)."""
    turn = np.array((math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)))
    return NavState(
        time_us, swap_attitude(turn), np.zeros(3), swap_enu_ned(np.array(position)), np.zeros(3),
        np.eye(6), np.eye(3), np.zeros(3), np.zeros(3), None, yaw_aligned=True,
        dead_reckoning=False, local_position_valid=True, global_position_valid=True)


def pose_of(message: TransformStamped) -> Pose:
    place, turn = message.transform.translation, message.transform.rotation
    return Pose(np.array((place.x, place.y, place.z)),
                np.array((turn.w, turn.x, turn.y, turn.z)))


def test_in_the_odometry_frame_it_is_the_fused_pose() -> None:
    bench = Bench(world_frame='odom', transform_time_offset=0.05)
    bench.transforms.note_odometry(odometry(1.0))
    bench.transforms.publish(state(1_001_000_000, (3.0, 4.0, 5.0), 0.5))
    message, = bench.sent
    assert (message.header.frame_id, message.child_frame_id) == ('odom', 'base_link')
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1001, 50_000_000)
    np.testing.assert_allclose(pose_of(message).position, (3.0, 4.0, 5.0), atol=1e-12)
    np.testing.assert_allclose(
        pose_of(message).quaternion, (math.cos(0.25), 0.0, 0.0, math.sin(0.25)), atol=1e-12)


def test_in_the_map_it_is_that_of_the_odometry_frame() -> None:
    """The odometry goes along x with 1 m/s; between two messages it is interpolated."""
    bench = Bench()
    first, second = odometry(1.0), odometry(1.2)
    for message in (first, second):
        bench.transforms.note_odometry(message)
    bench.transforms.publish(state(1_001_150_000, (30.0, 4.0, 5.0), 0.5))
    message, = bench.sent
    assert (message.header.frame_id, message.child_frame_id) == ('map', 'odom')
    ends = [Pose(np.array((x, 0.0, 0.0)), np.array((1.0, 0.0, 0.0, 0.0))) for x in (1.0, 1.2)]
    product = compose(pose_of(message), interpolate(*ends, 0.75))
    np.testing.assert_allclose(product.position, (30.0, 4.0, 5.0), atol=1e-9)
    np.testing.assert_allclose(
        product.quaternion, (math.cos(0.25), 0.0, 0.0, math.sin(0.25)), atol=1e-9)


def test_with_a_session_map_odom_base_is_the_output_at_every_stamp() -> None:
    """The odometry goes along x with 1 m/s, so that odom -> base_link is known at any time."""
    bench, session = Bench(), FusionSession(Params(), ('odometry', 'fix'))
    outputs = []
    for step in range(1, 600):
        message = odometry(0.1 * step)
        bench.transforms.note_odometry(message)
        for output in session.handle('odometry', message):
            bench.transforms.publish(output.nav)
            outputs.append(output.nav)
        if step % 2 == 0:
            session.handle('fix', fix(0.1 * step))
    assert len(bench.sent) == len(outputs) > 100
    for nav, message in zip(outputs, bench.sent, strict=True):
        own = Pose(np.array((1e-6 * nav.time_us - 1000.0, 0.0, 0.0)), np.array((1.0, 0, 0, 0)))
        product = compose(pose_of(message), own)
        np.testing.assert_allclose(product.position, swap_enu_ned(nav.position), atol=1e-9)
        attitude = swap_attitude(nav.quaternion)
        assert abs(product.quaternion @ attitude) == pytest.approx(1.0, abs=1e-12)


def test_without_odometry_the_map_has_no_transform_yet() -> None:
    bench = Bench()
    bench.transforms.publish(state(1_001_000_000, (0.0, 0.0, 0.0), 0.0))
    assert bench.sent == []
    assert bench.transforms.report().text == 'map -> odom waits for the first estimate'


def test_an_odometry_in_another_frame_is_told_once() -> None:
    bench = Bench()
    for step in range(3):
        message = odometry(1.0 + 0.1 * step)
        message.header.frame_id = 'camera_odom'
        bench.transforms.note_odometry(message)
        bench.transforms.publish(state(1_001_000_000 + step, (0.0, 0.0, 0.0), 0.0))
    assert bench.sent == []
    assert bench.warned == [
        "map -> odom is not published: the odometry is in frame 'camera_odom': set "
        'node.odom_frame to that name']


def test_what_another_node_publishes_is_left_to_it(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [100.0]
    monkeypatch.setattr(
        'ekf_fusion_ros.node.transforms.time.monotonic', lambda: clock[0])
    bench = Bench(world_frame='odom')
    bench.transforms.publish(state(1_001_000_000, (0.0, 0.0, 0.0), 0.0))
    heard = type('TFMessage', (), {'transforms': list(bench.sent)})()
    bench.transforms.hear(heard)
    bench.transforms.publish(state(1_001_020_000, (0.0, 0.0, 0.0), 0.0))
    assert len(bench.sent) == 2
    heard.transforms = [TransformStamped(child_frame_id='camera_link')]
    bench.transforms.hear(heard)
    assert bench.transforms.report().text == 'publishing odom -> base_link'
    foreign = TransformStamped(child_frame_id='/base_link')
    foreign.header.frame_id = 'vio_odom'
    heard.transforms = [foreign]
    bench.transforms.hear(heard)
    bench.transforms.publish(state(1_001_040_000, (0.0, 0.0, 0.0), 0.0))
    bench.transforms.publish(state(1_001_060_000, (0.0, 0.0, 0.0), 0.0))
    assert len(bench.sent) == 2
    assert bench.warned == [bench.transforms.report().text]
    assert 'another node publishes vio_odom -> base_link' in bench.warned[0]
    clock[0] += 60.0
    bench.transforms.publish(state(1_001_080_000, (0.0, 0.0, 0.0), 0.0))
    assert len(bench.sent) == 3
    assert bench.warned[1] == 'publishing odom -> base_link'


@pytest.mark.parametrize(('values', 'words'), [
    ({'world_frame': 'elsewhere'}, 'must be that of'),
    ({'map_frame': 'odom'}, 'must differ'),
    ({'use_odometry': False, 'use_imu': True}, 'needs the odometry'),
])
def test_frames_without_a_place_in_the_tree_are_refused(
    values: dict[str, Any], words: str,
) -> None:
    changes = {f'node.{name}': value for name, value in values.items()}
    with pytest.raises(ValueError, match=words):
        check_frames(with_overrides(Params(), changes).node)


@pytest.mark.slow
@pytest.mark.skipif(HAS_TF, reason='tf2_msgs is installed')
def test_without_tf2_msgs_the_node_says_what_is_missing(start_fuser: StartFuser) -> None:
    fuser = start_fuser({'node.publish_tf': True})
    assert fuser.wait() == 2
    assert fuser.output.strip().splitlines()[-1] == (
        'fuser: node.publish_tf is true, but tf2_msgs cannot be imported: install '
        'ros-jazzy-tf2-msgs, or set it to false')


@pytest.mark.slow
@pytest.mark.skipif(not HAS_TF, reason='tf2_msgs is not installed')
def test_the_node_publishes_tf(start_fuser: StartFuser, peer: Peer) -> None:
    from tf2_msgs.msg import TFMessage
    heard: list[TransformStamped] = []
    peer.node.create_subscription(
        TFMessage, '/tf', lambda message: heard.extend(message.transforms), 100)
    fuser = start_fuser({'node.publish_tf': True})
    peer.connect(fuser, {'odom': Odometry, 'fix': NavSatFix})
    step = 0
    while not heard:
        step += 1
        assert step < 5000, peer.texts()
        peer.publish('odom', odometry(0.1 * step))
        peer.publish('fix', fix(0.1 * step))
        peer.until(lambda step=step: peer.count('odometry') >= step - 200, fuser)
    assert (heard[0].header.frame_id, heard[0].child_frame_id) == ('map', 'odom')
