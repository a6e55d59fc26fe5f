"""The running node: signals, arguments, quality of service, parameters, bad messages."""

from __future__ import annotations

from collections.abc import Callable
import math
from pathlib import Path
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import pytest

rclpy = pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import DescribeParameters
from rclpy.qos import ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import NavSatFix

from ekf_fusion_ros.node.fusion_node import FusionNode
from ekf_fusion_ros.session import FusionSession

if TYPE_CHECKING:
    from fuser_process import Fuser
    from fuser_process import Peer

pytestmark = pytest.mark.slow
StartFuser = Callable[..., 'Fuser']
TWO_TOPICS = {'odom': Odometry, 'fix': NavSatFix}


def odometry(time_s: float) -> Odometry:
    """Return odometry that drives along x with 1 m/s."""
    message = Odometry()
    message.header.frame_id, message.child_frame_id = 'odom', 'base_link'
    message.header.stamp.sec = 1000 + int(time_s)
    message.header.stamp.nanosec = round(time_s % 1 * 1e9)
    message.pose.pose.position.x = time_s
    message.pose.pose.orientation.w = 1.0
    message.twist.twist.linear.x = 1.0
    message.pose.covariance[::7] = 0.01
    message.twist.covariance[::7] = 0.01
    return message


def fix(time_s: float) -> NavSatFix:
    """Return a fix with 1 m accuracy that goes east with 1 m/s."""
    message = NavSatFix(latitude=47.0, longitude=8.0 + time_s / 76056.0, altitude=400.0)
    message.header.stamp = odometry(time_s).header.stamp
    message.status.status = 0
    message.position_covariance[::4] = 1.0
    message.position_covariance_type = NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN
    return message


@pytest.mark.parametrize(('kind', 'gaps'), [
    (signal.SIGINT, []), (signal.SIGINT, [0.0]), (signal.SIGINT, [0.001, 0.02]),
    (signal.SIGTERM, []),
])
def test_signals_end_the_node_cleanly(
    start_fuser: StartFuser, peer: Peer, kind: signal.Signals, gaps: list[float],
) -> None:
    fuser = start_fuser()
    peer.connect(fuser, TWO_TOPICS)
    fuser.interrupt(kind)
    for gap in gaps:
        time.sleep(gap)
        fuser.interrupt(kind)
    assert fuser.wait() == 0, fuser.output
    assert 'Traceback' not in fuser.output


@pytest.mark.parametrize(('parameters', 'words'), [
    ({'ekf2.gnss.delay_ms': -1.0}, 'ekf2.gnss.delay_ms'),
    ({'ekf2.gnss.no_such_thing': 1.0}, 'unknown parameter ekf2.gnss.no_such_thing'),
    ({'node.use_odometry': False}, 'inertial input'),
    ({'node.use_fix': False, 'node.use_fix_velocity': True}, 'fix_velocity needs a fix'),
    ({'session.origin_from': 'parameter'}, 'give session.origin too'),
])
def test_unusable_parameters_are_refused(
    start_fuser: StartFuser, parameters: dict[str, object], words: str,
) -> None:
    fuser = start_fuser(parameters)
    assert fuser.wait() == 2
    assert len(fuser.output.splitlines()) == 1
    assert words in fuser.output


def test_topics_have_their_quality_of_service(start_fuser: StartFuser, peer: Peer) -> None:
    fuser = start_fuser({'node.use_imu': True})
    peer.connect(fuser, TWO_TOPICS)
    for topic in ('/odometry/filtered', '/odometry/gps', '/gps/filtered'):
        profiles = [info.qos_profile for info in peer.node.get_publishers_info_by_topic(topic)]
        assert [profile.reliability for profile in profiles] == [ReliabilityPolicy.RELIABLE]
    for topic in ('/odom', '/fix', '/imu'):
        profiles = [
            info.qos_profile for info in peer.node.get_subscriptions_info_by_topic(topic)]
        assert [profile.reliability for profile in profiles] == [ReliabilityPolicy.BEST_EFFORT]


def test_further_roles_listen_to_the_message_that_is_chosen(start_fuser: StartFuser) -> None:
    fuser = start_fuser({
        'node.use_range': True, 'node.use_flow': True, 'node.use_landed': True,
        'node.use_airspeed': True, 'node.airspeed_type': 'twist',
        'node.use_gps_heading': True, 'node.gps_heading_type': 'pose'})
    deadline = time.monotonic() + 120.0
    while 'not listening to' not in fuser.output and time.monotonic() < deadline:
        time.sleep(0.1)
    for line in ('range: Range on /range', 'flow: Vector3Stamped on /flow',
                 'airspeed: TwistStamped on /airspeed', 'landed: Bool on /landed',
                 'gps_heading: PoseStamped on /gps_heading'):
        assert line in fuser.output
    unused = ('imu, fix_velocity, magnetic_field, pressure, armed, aux_velocity, fix_2, '
              'fix_velocity_2, fix_3, fix_velocity_3')
    assert f'not listening to {unused}:' in fuser.output


def test_parameters_are_described_to_other_nodes(start_fuser: StartFuser, peer: Peer) -> None:
    fuser = start_fuser()
    client = peer.node.create_client(DescribeParameters, '/fuser/describe_parameters')
    peer.until(client.service_is_ready, fuser)
    answer = client.call_async(DescribeParameters.Request(names=['ekf2.gnss.delay_ms']))
    peer.until(answer.done, fuser)
    descriptor = answer.result().descriptors[0]
    assert not descriptor.read_only
    assert 'unit: ms' in descriptor.additional_constraints
    assert descriptor.floating_point_range[0].to_value > 0


def test_silence_is_said(start_fuser: StartFuser, peer: Peer) -> None:
    fuser = start_fuser()
    peer.connect(fuser, TWO_TOPICS)
    assert peer.reports['estimator'].message == (
        'waiting for odometry: /odom has 0 messages, 1 reliable publisher')
    assert peer.reports['odometry'].message == 'nothing received on /odom yet'
    assert peer.reports['fix'].message == 'nothing received on /fix yet'


def test_diagnostics_are_stamped_by_the_clock_topic(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    fuser = start_fuser({'use_sim_time': True})
    stamps: list[int] = []
    peer.node.create_subscription(
        DiagnosticArray, '/diagnostics', lambda one: stamps.append(one.header.stamp.sec), 10)
    clock = peer.node.create_publisher(Clock, '/clock', 10)
    message = Clock()
    message.clock.sec = 1234

    def stamped() -> bool:
        clock.publish(message)
        return 1234 in stamps

    peer.until(stamped, fuser)


def bad_odometry() -> dict[str, Odometry]:
    """Return odometry messages that are each wrong in one way, by what is wrong."""
    made = {name: odometry(10.0 + 0.1 * number) for number, name in enumerate((
        'nan position', 'infinite velocity', 'zero quaternion', 'negative covariance',
        'nan covariance', 'zero stamp'))}
    made['nan position'].pose.pose.position.y = math.nan
    made['infinite velocity'].twist.twist.linear.x = math.inf
    made['zero quaternion'].pose.pose.orientation.w = 0.0
    made['negative covariance'].pose.covariance[0] = -1.0
    made['nan covariance'].pose.covariance[7] = math.nan
    made['zero stamp'].header.stamp.sec = made['zero stamp'].header.stamp.nanosec = 0
    return made


def bad_fixes() -> list[NavSatFix]:
    """Return fixes that are each wrong in one way."""
    made = [fix(10.0 + 0.1 * number) for number in range(3)]
    made[0].status.status = -1
    made[1].latitude = 91.0
    made[2].longitude = math.nan
    return made


def test_bad_messages_are_counted_and_the_node_lives_on(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    fuser = start_fuser()
    peer.connect(fuser, TWO_TOPICS)
    bad, fixes = list(bad_odometry().values()), bad_fixes()
    stream = [odometry(9.8), odometry(9.9), odometry(9.9), odometry(9.85), *bad, odometry(10.7)]
    for number, message in enumerate(stream):
        peer.publish('odom', message)
        peer.until(lambda n=number: peer.count('odometry') == n + 1, fuser)
    for number, message in enumerate([*fixes, fix(10.7)]):
        peer.publish('fix', message)
        peer.until(lambda n=number: peer.count('fix') == n + 1, fuser)
    assert peer.count('odometry', 'accepted') == 3
    assert peer.count('odometry', 'refused') == len(bad) + 2
    assert peer.count('odometry', 'refused.repeated_stamp') == 1
    assert peer.count('odometry', 'refused.backward_stamp') == 1
    assert peer.count('fix', 'refused') == len(fixes)
    assert peer.count('fix', 'refused.no_fix') == 1
    assert peer.count('fix', 'accepted') == 1


def test_overflow_of_the_queue_is_counted(start_fuser: StartFuser, peer: Peer) -> None:
    fuser = start_fuser({'node.queue_limit': 10, 'node.core_rate': 1.0})
    peer.connect(fuser, TWO_TOPICS)
    sent = 0
    while not peer.count('odometry', 'refused.queue_overflow'):
        for _ in range(5):
            peer.publish('odom', odometry(0.1 * sent))
            sent += 1
        before = peer.reports['odometry']
        peer.until(lambda seen=before: peer.reports['odometry'] is not seen, fuser)
    peer.until(lambda: peer.count('odometry') == sent, fuser)
    assert peer.count('odometry', 'pending') == 0


LISTENER = """
import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node
rclpy.init()
node = Node('listener')
node.create_subscription(Odometry, 'odometry/filtered', lambda m: print('heard', flush=True), 10)
rclpy.spin(node)
"""


def test_a_killed_listener_does_not_stop_the_node(
    tmp_path: Path, start_fuser: StartFuser, peer: Peer,
) -> None:
    fuser = start_fuser({'node.use_fix': False})
    peer.connect(fuser, {'odom': Odometry})
    heard = tmp_path / 'heard'
    with heard.open('wb') as stream:
        listener = subprocess.Popen([sys.executable, '-c', LISTENER], stdout=stream)
    sent = 0

    def drive_until(condition: Callable[[], bool]) -> None:
        nonlocal sent
        while not condition():
            peer.publish('odom', odometry(0.05 * sent))
            sent += 1
            peer.until(lambda floor=sent - 5: peer.count('odometry') > floor, fuser)

    try:
        drive_until(lambda: heard.stat().st_size > 0)
    finally:
        listener.kill()
        listener.wait()
    before = len(peer.odometry)
    drive_until(lambda: len(peer.odometry) > before + 50)
    assert peer.odometry[-1].header.frame_id == 'odom'
    assert all(math.isfinite(message.pose.pose.position.x) for message in peer.odometry)


def test_an_unexpected_error_is_counted_and_said_once(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str],
) -> None:
    rclpy.init()
    node = FusionNode()
    try:
        def fail(*_: object) -> None:
            raise ArithmeticError('the unthinkable')

        monkeypatch.setattr(FusionSession, 'handle', fail)
        for number in range(3):
            node._queue('odometry', odometry(number))
        while node._intake:
            node._run_core()
        assert node._work.trouble['internal_errors'] == 3
        node._reporting.report()
    finally:
        node.destroy_node()
        rclpy.shutdown()
    said = capfd.readouterr().err
    assert said.count('the node goes on: ArithmeticError: the unthinkable') == 1
