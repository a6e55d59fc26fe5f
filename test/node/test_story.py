"""What the node tells of itself: every sentence of state is provoked over DDS and read."""

from __future__ import annotations

from collections.abc import Callable
import re
import time
from typing import TYPE_CHECKING

import pytest

rclpy = pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from node.test_fuser import TWO_TOPICS
from node.test_fuser import fix
from node.test_fuser import odometry
from node.test_life import Drive
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy
from rclpy.qos import QoSProfile
from rclpy.qos import ReliabilityPolicy
from sensor_msgs.msg import Imu
from sensor_msgs.msg import NavSatFix

from ekf_fusion_ros.ekf2.gnss_checks import CHECK_NAMES
from ekf_fusion_ros.live.situation import PREPARING
from ekf_fusion_ros.node import fusion_node

if TYPE_CHECKING:
    from fuser_process import Fuser
    from fuser_process import Peer

pytestmark = pytest.mark.slow
StartFuser = Callable[..., 'Fuser']
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
OK, WARN = b'\x00', b'\x01'


def state(peer: Peer) -> str:
    """Return the sentence of state, '' before the first."""
    return peer.texts().get('estimator', '')


def values(peer: Peer, subject: str) -> dict[str, str]:
    return {item.key: item.value for item in peer.reports[subject].values}


def drive_until(drive: Drive, begin: float, condition: Callable[[], bool]) -> float:
    """Drive on from a time, a second at once, until something is so; return the time then."""
    end = begin
    while not condition():
        assert end - begin < 300.0, drive.peer.texts()
        drive.between(end, end + 1.0)
        end += 1.0
    return end


def test_a_missing_fix_is_told_with_its_topic_count_and_publishers(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    fuser = start_fuser()
    for _ in range(2):
        peer.node.create_publisher(NavSatFix, 'fix', BEST_EFFORT)
    peer.connect(fuser, {'odom': Odometry})
    sent = 0

    def waits_for_a_fix() -> bool:
        nonlocal sent
        peer.publish('odom', odometry(0.1 * sent))
        sent += 1
        return state(peer) == (
            'waiting for a fix: /fix has 0 messages, 2 best-effort publishers')

    peer.until(waits_for_a_fix, fuser)
    assert peer.reports['estimator'].level == WARN
    # the log tells of the same silence
    peer.until(lambda: 'nothing is published: waiting for a fix: /fix has 0 messages'
               in fuser.output, fuser)


def test_fixes_that_are_all_refused_are_told_with_the_last_reason(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    fuser = start_fuser()
    peer.connect(fuser, TWO_TOPICS)
    sent = 0

    def told() -> bool:
        nonlocal sent
        peer.publish('odom', odometry(0.1 * sent))
        lost = fix(0.1 * sent)
        lost.status.status = -1
        peer.publish('fix', lost)
        sent += 1
        return state(peer).startswith('waiting for a usable fix: /fix has ')

    peer.until(told, fuser)
    assert re.search(r'has \d+ messages, refused: \d+ no_fix; the last: .+', state(peer))
    assert values(peer, 'fix')['last_refusal']
    assert 'refused: no_fix' in peer.texts()['fix']


def test_a_publisher_of_another_type_is_named(start_fuser: StartFuser, peer: Peer) -> None:
    fuser = start_fuser()
    peer.node.create_publisher(Imu, 'odom', 10)
    peer.until(lambda: state(peer) == (
        'waiting for odometry: /odom has 0 messages, 1 of type sensor_msgs/msg/Imu instead of '
        'nav_msgs/msg/Odometry'), fuser)


def test_from_alignment_through_ok_to_dead_reckoning_and_back(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    """One drive, along which each sentence of state has its turn."""
    fuser = start_fuser()
    drive = Drive(peer, fuser).connect()
    sentences: list[str] = []

    def hears(pattern: str) -> bool:
        sentences.append(state(peer))
        return any(re.match(pattern, one) for one in sentences)

    now = drive_until(drive, 0.0, lambda: hears(
        r'aligning yaw from motion: sigma \d+ deg, drive \d+ m'))
    now = drive_until(drive, now, lambda: hears('ok: fusing GNSS, odometry '))
    assert peer.reports['estimator'].level == OK
    begin = now
    while not hears(r'dead reckoning on odometry \d+ s; fusing odometry '):
        assert now < begin + 120.0, peer.texts()
        without_fix(drive, now, now + 1.0)
        now += 1.0
    assert peer.reports['estimator'].level == WARN
    peer.until(lambda: 'none for' in peer.texts()['fix'], fuser)
    sentences.clear()
    drive_until(drive, now, lambda: hears('ok: fusing GNSS, odometry '))


def without_fix(drive: Drive, begin: float, end: float) -> None:
    """Drive on while the receiver is silent."""
    for tenth in range(round(10 * begin), round(10 * end)):
        drive.peer.publish('odom', odometry(0.1 * tenth))
        drive.sent += 1
    drive.peer.until(lambda: drive.peer.count('odometry') >= drive.sent, drive.fuser)


def test_every_source_check_and_output_has_its_numbers(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    fuser = start_fuser()
    drive = Drive(peer, fuser).connect()
    drive_until(drive, 0.0, lambda: state(peer).startswith('ok'))
    for source in TWO_TOPICS:
        source = {'odom': 'odometry'}.get(source, source)
        numbers = values(peer, source)
        for key in ('rate', 'age', 'delay', 'test_ratio', 'fused', 'rejected', 'accepted'):
            assert float(numbers[key]) >= 0.0, (source, key)
        assert int(numbers['fused']) > 0
        assert {'last_refusal', 'last_rejection', 'in_use'} <= set(numbers)
        # the stamps are of the year 1970
        assert 'behind the clock of this node' in peer.texts()[source]
    checks = values(peer, 'gps checks')
    assert len(checks) == len(CHECK_NAMES) == 10
    for name, verdict in checks.items():
        assert re.match(r'(pass|fail): [\d.e-]+, limit [\d.e-]+|skipped', verdict), (name, verdict)
    told = [verdict.partition(':')[0] for verdict in checks.values()]
    assert told.count('skipped') >= 2
    assert 'pass' in told
    assert {'busy_share', 'longest_run_ms', 'late_samples', 'horizon_delay', 'queued'} <= set(
        values(peer, 'timing'))
    assert re.match(r'busy \d+ % of the time', peer.texts()['timing'])
    assert re.match(r'/odometry/filtered at [\d.]+ Hz', peer.texts()['output'])
    assert float(values(peer, 'output')['rate']) > 0.0


def test_a_check_that_fails_is_told_with_value_and_limit(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    fuser = start_fuser({'ekf2.gnss.checks.req_hacc': 0.5})
    drive = Drive(peer, fuser).connect()
    # the fixes have 1 m
    drive_until(drive, 0.0, lambda: 'failing: max_horz_err (1, limit 0.5)'
                in peer.texts().get('gps checks', ''))
    assert peer.reports['gps checks'].level == WARN
    assert values(peer, 'gps checks')['max_horz_err'] == 'fail: 1, limit 0.5'
    drive_until(drive, drive.sent / 10.0, lambda: re.match(
        r'waiting for the GNSS checks to pass \(.*\bhacc\b.* failing\)', state(peer)) is not None)
    assert peer.odometry == []
    peer.until(lambda: 'nothing on /odometry/filtered' in peer.texts()['output'], fuser)


def test_fixes_that_the_filter_rejects_are_told(start_fuser: StartFuser, peer: Peer) -> None:
    fuser = start_fuser()
    drive = Drive(peer, fuser).connect()
    now = drive_until(drive, 0.0, lambda: state(peer).startswith('ok'))
    seen: list[str] = []
    rejections: list[str] = []

    def rejected() -> bool:
        seen.append(peer.texts()['fix'])
        rejections.append(values(peer, 'fix').get('last_rejection', ''))
        return any('gnss_position rejected by the filter' in one for one in seen)

    tenth = round(10 * now)
    while not rejected():
        assert tenth < 10 * now + 200, seen[-1]
        peer.publish('odom', odometry(0.1 * tenth))
        drive.sent += 1
        if tenth % 2 == 0:
            far = fix(0.1 * tenth)
            far.latitude += 0.001
            peer.publish('fix', far)
        tenth += 1
        peer.until(lambda: peer.count('odometry') >= drive.sent, fuser)
    assert any(re.search(r'gnss_position: innovation 11\d.*, [\d.]+ times its limit', one)
               for one in rejections)


def test_qualities_of_service_that_do_not_match_are_told(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    """One publisher that the node cannot hear, one listener that cannot hear the node."""
    fuser = start_fuser({'qos_overrides./odom.subscription.reliability': 'reliable'})
    peer.node.create_publisher(Odometry, 'odom', BEST_EFFORT)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    peer.node.create_subscription(Odometry, 'odometry/filtered', lambda _: None, latched)
    peer.until(lambda: '/odom: a publisher offers reliability that does not match, and nothing '
               'of it is heard: change it there, or qos_overrides./odom.subscription here'
               in fuser.output, fuser)
    peer.until(lambda: '/odometry/filtered: a listener asks for durability that does not match'
               in fuser.output, fuser)


def test_while_the_clock_stands_the_node_fuses_and_reports(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    """`use_sim_time` without anybody who publishes /clock."""
    fuser = start_fuser({'use_sim_time': True})
    drive = Drive(peer, fuser).connect().between(0.0, 40.0)
    drive.until_row(39.0)
    peer.until(lambda: state(peer).startswith('ok'), fuser)
    assert values(peer, 'odometry')['delay'] == ''


def inertial(time_s: float) -> Imu:
    """Return what an IMU at rest or at constant speed on level ground measures."""
    message = Imu()
    message.header.stamp = odometry(time_s).header.stamp
    message.header.frame_id = 'base_link'
    message.linear_acceleration.z = 9.81
    return message


def test_a_slow_imu_then_nothing_else_then_nothing_at_all(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    """50 Hz of IMU; the odometry and the fixes end first, then the IMU."""
    fuser = start_fuser({'node.use_imu': True})
    peer.connect(fuser, {**TWO_TOPICS, 'imu': Imu})
    sent = 0

    def drive_until_told(subject: str, pattern: str, *, alone: bool = False) -> None:
        nonlocal sent
        while not re.match(pattern, peer.texts()[subject]):
            assert sent < 10000, peer.texts()
            for step in range(sent, sent + 25):
                peer.publish('imu', inertial(0.02 * step))
                if step % 5 == 0 and not alone:
                    peer.publish('odom', odometry(0.02 * step))
                if step % 10 == 0 and not alone:
                    peer.publish('fix', fix(0.02 * step))
            sent += 25
            peer.until(lambda goal=sent: peer.count('imu') >= goal, fuser)

    drive_until_told('navigation', 'home not set: no valid global position, for ')
    drive_until_told(
        'estimator', r'ok: fusing GNSS.*; imu comes at 50\.\d Hz, less than the 100 Hz that')
    assert peer.reports['estimator'].level == WARN
    drive_until_told('navigation', r'home set: 47\.0')
    drive_until_told('estimator', r'dead reckoning on inertial data for \d+ s', alone=True)
    peer.until(lambda: re.match(
        r'no IMU data for \d+ s: /imu has 1 reliable publisher$', state(peer)) is not None, fuser)
    peer.until(lambda: 'position and velocity not valid: no inertial input for'
               in peer.texts()['navigation'], fuser)


def test_the_other_estimator_tells_its_state_too(start_fuser: StartFuser, peer: Peer) -> None:
    fuser = start_fuser({'estimator': 'lpe'})
    drive = Drive(peer, fuser).connect()
    assert state(peer) == 'waiting for odometry: /odom has 0 messages, 1 reliable publisher'
    drive_until(drive, 0.0, lambda: state(peer).startswith('ok: fusing '))
    assert 'gnss' in values(peer, 'estimator')['in_use']
    assert int(values(peer, 'fix')['fused']) > 0


class NeverReady:
    """Kernels that are not ready until the test says so."""

    done = False
    error = None

    def __init__(self, *_: object) -> None:
        pass

    def join(self) -> None:
        pass


def test_while_kernels_compile_the_node_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the process of the test: how long compiling takes is not in its hands."""
    monkeypatch.setattr(fusion_node, 'Preparation', NeverReady)
    rclpy.init()
    node = fusion_node.FusionNode()
    listener = rclpy.create_node('listener')
    heard: list[str] = []
    listener.create_subscription(
        DiagnosticArray, '/diagnostics',
        lambda message: heard.append(message.status[0].message), 10)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    executor.add_node(listener)
    deadline = time.monotonic() + 60.0

    def until(condition: Callable[[], bool]) -> None:
        while not condition():
            assert time.monotonic() < deadline, heard
            executor.spin_once(timeout_sec=0.05)

    try:
        node.begin(lambda: False)
        until(lambda: PREPARING in heard)
        monkeypatch.setattr(NeverReady, 'done', True)
        # what it waits for comes with the start, not with the next turn of the timer
        executor.remove_node(node)
        node._start_when_ready()
        until(lambda: any(one.startswith('waiting for odometry') for one in heard))
    finally:
        executor.shutdown()
        node.end()
        listener.destroy_node()
        rclpy.shutdown()
