"""What the node tells of trouble: stalls, too much work, take-off, transforms of others."""

from __future__ import annotations

from collections.abc import Callable
import re
import signal
import time
from types import SimpleNamespace
from typing import TYPE_CHECKING
from typing import Any

import pytest

rclpy = pytest.importorskip('rclpy')

from geometry_msgs.msg import TransformStamped
from node.test_company import hear
from node.test_fuser import TWO_TOPICS
from node.test_fuser import fix
from node.test_fuser import odometry
from node.test_life import Drive
from node.test_life import events_of
from node.test_life import told
from node.test_story import drive_until
from node.test_story import state
from node.test_story import values
from rclpy.node import Node
from std_msgs.msg import Bool

from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.node import static_frames
from ekf_fusion_ros.node import transforms
from ekf_fusion_ros.node.fusion_node import STALL_S
from ekf_fusion_ros.node.fusion_node import FusionNode
from ekf_fusion_ros.node.qos import latched_qos

if TYPE_CHECKING:
    from fuser_process import Fuser
    from fuser_process import Peer

pytestmark = pytest.mark.slow
StartFuser = Callable[..., 'Fuser']
FLAGS = ('global_position_valid', 'local_position_valid', 'local_velocity_valid')


def level(peer: Peer, subject: str) -> int:
    return ord(peer.reports[subject].level)


def test_a_node_that_was_held_up_and_one_that_is_flooded_say_so(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    fuser = start_fuser({'node.core_rate': 20.0})
    peer.connect(fuser, TWO_TOPICS)
    troubled: list[str] = []

    def stalled() -> bool:
        if re.search(r'; \d+ times busy for long, inputs may be lost', state(peer)):
            troubled.append(state(peer))
        return bool(troubled)

    fuser.interrupt(signal.SIGSTOP)
    resumed = time.monotonic() + 2.0 * STALL_S
    peer.until(lambda: time.monotonic() > resumed, fuser)
    fuser.interrupt(signal.SIGCONT)
    peer.until(stalled, fuser)
    assert int(values(peer, 'estimator')['stalls']) > 0
    sent = 0

    def busy() -> bool:
        nonlocal sent
        if values(peer, 'timing')['queued'] == '0' and peer.count('odometry') >= sent:
            # as many as a best-effort input keeps
            for step in range(sent, sent + 200):
                peer.publish('odom', odometry(0.1 * step))
                peer.publish('fix', fix(0.1 * step))
            sent += 200
        return level(peer, 'timing') == HealthLevel.WARN

    peer.until(busy, fuser)
    assert re.fullmatch(
        r'busy (9\d|1\d\d) % of the time, \d+ messages waiting', peer.texts()['timing'])
    shares = [float(values(peer, 'timing')[name]) for name in ('busy_share', 'thread_share')]
    assert max(shares) > 0.9


def test_arming_too_early_and_a_failure_after_take_off(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    """Fixes jump by 111 m in the air; the vehicle lands, is disarmed and all is well again."""
    fuser = start_fuser({
        'node.use_armed': True, 'node.use_landed': True, 'ekf2.aiding.vehicle': 'multirotor',
        'health.arm_without_gps': False})
    events = events_of(peer)
    flags = {name: hear(peer, Bool, f'navigation/{name}', latched_qos()) for name in FLAGS}
    peer.connect(fuser, {**TWO_TOPICS, 'armed': Bool, 'landed': Bool})
    drive = Drive(peer, fuser)

    def say(topic: str, value: bool) -> None:
        before = peer.count(topic)
        peer.publish(topic, Bool(data=value))
        peer.until(lambda: peer.count(topic) > before, fuser)

    def flags_are(value: bool) -> bool:
        return all(heard and heard[-1].data is value for heard in flags.values())

    say('landed', True)
    drive.between(0.0, 1.0)
    say('armed', True)
    drive.between(1.0, 2.0)
    peer.until(lambda: told(events, 'armed though health.arm_without_gps is off: home not set: '
                                    'no valid global position'), fuser)
    say('armed', False)
    now = drive_until(drive, 2.0, lambda: flags_are(True))
    say('armed', True)
    say('landed', False)
    begin = now
    while level(peer, 'navigation') != HealthLevel.ERROR:
        assert now < begin + 20.0, peer.texts()
        now = off_course(drive, now)
    assert peer.texts()['navigation'] == (
        'navigation failed after take-off: disarm, and check compass and heading')
    assert values(peer, 'navigation')['takeoff_test'] == 'failed'
    peer.until(lambda: flags_are(False), fuser)
    for words in ('navigation failed after take-off: innovations failed for 1 s; position and '
                  'velocity are not valid until the vehicle is disarmed',
                  'local velocity no longer valid: the take-off navigation test has failed'):
        peer.until(lambda words=words: told(events, words) and words in fuser.output, fuser)
    say('landed', True)
    say('armed', False)
    drive_until(drive, now, lambda: flags_are(True))
    assert values(peer, 'navigation')['takeoff_test'] == 'open'


def off_course(drive: Drive, begin: float) -> float:
    """Drive half a second with fixes that are 111 m off; return when that ends."""
    for tenth in range(round(10 * begin), round(10 * begin) + 5):
        drive.peer.publish('odom', odometry(0.1 * tenth))
        drive.sent += 1
        far = fix(0.1 * tenth)
        far.latitude += 0.001
        drive.peer.publish('fix', far)
    drive.peer.until(lambda: drive.peer.count('odometry') >= drive.sent, drive.fuser)
    return begin + 0.5


class TFMessage:
    """Stands in for the type of TF, which need not be installed."""

    def __init__(self, transforms: list[TransformStamped]) -> None:
        self.transforms = transforms


class Bench:
    """A node in the process of the test; TF is handed over in memory, /diagnostics over DDS."""

    def __init__(self, peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
        self.peer = peer
        self.sent: list[TransformStamped] = []
        self.hear: dict[str, Callable[[TFMessage], None]] = {}
        for module in (transforms, static_frames):
            monkeypatch.setattr(module, 'imported', lambda *_: TFMessage)
        publisher = SimpleNamespace(publish=lambda message: self.sent.extend(message.transforms))
        advertise, subscribe = Node.create_publisher, Node.create_subscription

        def create_publisher(node: Node, kind: type, *rest: Any, **more: Any) -> Any:
            return publisher if kind is TFMessage else advertise(node, kind, *rest, **more)

        def create_subscription(
            node: Node, kind: type, topic: str, take: Callable[..., None], *rest: Any,
            **more: Any,
        ) -> Any:
            if kind is not TFMessage:
                return subscribe(node, kind, topic, take, *rest, **more)
            self.hear[topic] = take
            return None

        monkeypatch.setattr(FusionNode, 'create_publisher', create_publisher)
        monkeypatch.setattr(FusionNode, 'create_subscription', create_subscription)
        self.node = FusionNode()
        self.running: Any = SimpleNamespace(
            process=SimpleNamespace(poll=lambda: None), output='in the output of the test')

    def take(self, role: str, message: Any) -> None:
        """Give the filter a message."""
        self.node._queue(role, message)
        self.node._run_core()

    def tells(self, subject: str, sentence: str) -> None:
        """Wait until /diagnostics has a sentence."""
        def heard() -> bool:
            self.node._reporting.report()
            return self.peer.texts().get(subject) == sentence

        self.peer.until(heard, self.running)


@pytest.fixture
def bench(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> Any:
    rclpy.init(args=['fuser', '--ros-args', '-p', 'node.publish_tf:=true'])
    made = Bench(peer, monkeypatch)
    yield made
    made.node.destroy_node()
    rclpy.shutdown()


def foreign() -> TransformStamped:
    """Return what another node says of the odometry frame."""
    message = TransformStamped(child_frame_id='odom')
    message.header.frame_id = 'world'
    return message


def test_the_transform_of_another_node_and_its_end_are_told(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str],
) -> None:
    bench.tells('transforms', 'map -> odom waits for the first estimate')
    step = 0

    def drive(condition: Callable[[], bool]) -> None:
        nonlocal step
        while not condition():
            assert step < 1000
            bench.take('odometry', odometry(0.1 * step))
            bench.take('fix', fix(0.1 * step))
            step += 1

    drive(lambda: bool(bench.sent))
    bench.tells('transforms', 'publishing map -> odom')
    # its own comes back
    bench.hear['/tf'](TFMessage(bench.sent[-1:]))
    drive(lambda n=step: step > n)
    bench.tells('transforms', 'publishing map -> odom')
    bench.hear['/tf'](TFMessage([foreign()]))
    before = len(bench.sent)
    drive(lambda n=step: step > n + 1)
    assert len(bench.sent) == before
    sentence = ('map -> odom is not published: another node publishes world -> odom; stop that, '
                'or set node.publish_tf to false')
    bench.tells('transforms', sentence)
    assert level(bench.peer, 'transforms') == HealthLevel.WARN
    assert capfd.readouterr().err.count(sentence) == 1
    later = time.monotonic() + 60.0
    monkeypatch.setattr(transforms.time, 'monotonic', lambda: later)
    drive(lambda: len(bench.sent) > before)
    bench.tells('transforms', 'publishing map -> odom')
    assert 'publishing map -> odom' in capfd.readouterr().err


def test_mountings_from_tf_static_are_told_and_missing_ones_too(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str],
) -> None:
    events = events_of(bench.peer)
    arm = TransformStamped(child_frame_id='gps')
    arm.header.frame_id, arm.transform.translation.x = 'base_link', 0.5
    camera, antenna = odometry(0.0), fix(0.0)
    camera.child_frame_id, antenna.header.frame_id = 'camera', 'gps'
    bench.take('odometry', camera)
    bench.take('fix', antenna)
    assert len(bench.node._intake) == 2
    bench.hear['/tf_static'](TFMessage([arm]))
    later = time.monotonic() + static_frames.WAIT_S
    monkeypatch.setattr(static_frames.time, 'monotonic', lambda: later)
    bench.node._run_core()
    bench.peer.until(lambda: told(
        events, 'mounting by /tf_static: messages.fix.mount_xyz = (0.5, 0, 0)'), bench.running)
    assert ("odometry: /tf_static does not tie its frame 'camera' to 'base_link': it is taken "
            'to be mounted there; publish that, or set messages.odometry.mount_*'
            ) in capfd.readouterr().err
