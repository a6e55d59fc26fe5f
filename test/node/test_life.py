"""The node through jumps of time, silence, bad order, company, loss and restart."""

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import TYPE_CHECKING
from typing import Any

import pytest

rclpy = pytest.importorskip('rclpy')

from nav_msgs.msg import Odometry
from node.test_fuser import TWO_TOPICS
from node.test_fuser import fix
from node.test_fuser import odometry
from rcl_interfaces.msg import Log

from ekf_fusion_ros.node.qos import events_qos

if TYPE_CHECKING:
    from fuser_process import Fuser
    from fuser_process import Peer

pytestmark = pytest.mark.slow
StartFuser = Callable[..., 'Fuser']
BATCH = 50
"""Messages at once: a best-effort input keeps 200."""


class Drive:
    """A peer that drives along x, ten odometries and five fixes a second of stamps."""

    def __init__(self, peer: Peer, fuser: Fuser) -> None:
        self.peer = peer
        self.fuser = fuser
        self.sent = peer.count('odometry')

    def connect(self) -> Drive:
        self.peer.connect(self.fuser, TWO_TOPICS)
        self.sent = self.peer.count('odometry')
        return self

    def between(self, begin: float, end: float, late_fix: float = 0.0) -> Drive:
        """Drive from one time to another, fixes perhaps late, no faster than it is heard."""
        for k in range(round(10 * begin), round(10 * end)):
            self.peer.publish('odom', odometry(0.1 * k))
            self.sent += 1
            stamp = 0.1 * k - late_fix
            if k % 2 == 0 and stamp >= begin:
                self.peer.publish('fix', fix(stamp))
            if self.sent % BATCH == 0:
                self._wait()
        self._wait()
        return self

    def until_heard(self, begin: float) -> float:
        """Drive from a time on until the node hears; return when that is.

        A publisher may know the node later than the node knows the publisher.
        """
        tenths = round(10 * begin)

        def heard() -> bool:
            nonlocal tenths
            self.peer.publish('odom', odometry(0.1 * tenths))
            tenths += 1
            return self.peer.count('odometry') > 0

        self.peer.until(heard, self.fuser)
        seen = self.peer.report_count
        self.peer.until(lambda: self.peer.report_count >= seen + 5, self.fuser)
        self.sent = self.peer.count('odometry')
        return 0.1 * tenths

    def until_row(self, after: float) -> Odometry:
        """Wait for a row of the output after a time."""
        def found() -> list[Odometry]:
            return [row for row in self.peer.odometry if time_of(row) >= after]

        self.peer.until(lambda: bool(found()), self.fuser)
        return found()[0]

    def _wait(self) -> None:
        self.peer.until(lambda: self.peer.count('odometry') >= self.sent, self.fuser)


def time_of(message: Any) -> float:
    stamp = message.header.stamp
    return float(stamp.sec - 1000 + 1e-9 * stamp.nanosec)


def events_of(peer: Peer, topic: str = 'fuser/events') -> list[Log]:
    heard: list[Log] = []
    peer.node.create_subscription(Log, topic, heard.append, events_qos())
    return heard


def told(events: list[Log], words: str) -> bool:
    return any(words in event.msg for event in events)


def test_a_backward_jump_of_time_starts_again_and_is_announced(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    """As when a bag is played in a loop."""
    fuser = start_fuser()
    events = events_of(peer)
    drive = Drive(peer, fuser).connect().between(0.0, 40.0)
    drive.until_row(39.6)
    before = len(peer.odometry)
    drive.between(0.0, 40.0)
    peer.until(lambda: told(events, 'jumped by -39.800 s: the estimator starts again'), fuser)
    drive.between(40.0, 42.0)
    peer.until(lambda: any(time_of(row) > 40.5 for row in peer.odometry[before:]), fuser)
    # about the same origin: the places of before the jump keep their coordinates
    (x_before,), (x_again,) = ([
        row.pose.pose.position.x for row in rows if abs(time_of(row) - 39.5) < 0.004]
        for rows in (peer.odometry[:before], peer.odometry[before:]))
    assert x_again == pytest.approx(x_before, abs=1.0)


def test_a_forward_jump_of_time_starts_again_and_is_announced(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    fuser = start_fuser()
    events = events_of(peer)
    drive = Drive(peer, fuser).connect().between(0.0, 40.0)
    drive.until_row(39.0)
    drive.between(100.0, 140.0)
    peer.until(lambda: told(events, 'the estimator starts again'), fuser)
    drive.until_row(139.0)


def test_a_silence_is_said_and_ends_without_a_restart(start_fuser: StartFuser, peer: Peer) -> None:
    fuser = start_fuser()
    events = events_of(peer)
    drive = Drive(peer, fuser).connect().between(0.0, 40.0)
    drive.until_row(39.0)
    peer.until(lambda: peer.texts()['estimator'].startswith('no odometry for'), fuser)
    peer.until(lambda: 'nothing on' in peer.texts()['output'], fuser)
    # time has stood still for the source: its next stamps are 3 s later
    drive.between(43.0, 46.0)
    drive.until_row(45.0)
    assert told(events, 'no odometry message for 3')
    assert not told(events, 'starts again')


def test_late_fixes_within_the_horizon_are_used_and_later_ones_counted(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    fuser = start_fuser()
    drive = Drive(peer, fuser).connect().between(0.0, 40.0, late_fix=0.1)
    drive.until_row(39.0)
    assert peer.count('fix', 'refused') == 0
    accepted = peer.count('fix', 'accepted')
    drive.between(40.0, 45.0, late_fix=1.0)
    peer.until(lambda: peer.count('fix', 'refused.too_old') > 15, fuser)
    assert peer.count('fix', 'accepted') < accepted + 5
    drive.until_row(44.0)


def test_two_nodes_side_by_side_do_not_hear_each_other(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    first = start_fuser(remappings={'__ns': '/one'})
    start_fuser(remappings={'__ns': '/two'})
    heard: dict[str, list[Odometry]] = {'one': [], 'two': []}
    names = {kind: f'/one/{kind}' for kind in TWO_TOPICS}
    for space, rows in heard.items():
        peer.node.create_subscription(Odometry, f'/{space}/odometry/filtered', rows.append, 1000)
    peer.connect(first, {names[topic]: kind for topic, kind in TWO_TOPICS.items()})
    for k in range(400):
        peer.publish(names['odom'], odometry(0.1 * k))
        if k % 2 == 0:
            peer.publish(names['fix'], fix(0.1 * k))
        if k % BATCH == BATCH - 1:
            # both report; the one that is fed has received what was sent
            peer.until(lambda sent=k + 1: peer.count('odometry') >= sent, first)
    peer.until(lambda: bool(heard['one']), first)
    assert heard['one'][-1].header.frame_id == 'map'
    assert heard['two'] == []


def test_a_node_that_is_killed_in_flight_and_started_again_finds_its_way(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    first = start_fuser()
    drive = Drive(peer, first).connect().between(0.0, 40.0)
    drive.until_row(39.0)
    first.interrupt(signal.SIGKILL)
    first.wait()
    second = start_fuser()
    # until then the reports may be the last ones of the first
    silence = 'waiting for odometry: /odom has 0 messages'
    peer.until(lambda: peer.texts()['estimator'].startswith(silence), second)
    again = Drive(peer, second)
    begin = again.until_heard(40.0)
    again.between(begin, 80.0)
    row = again.until_row(79.0)
    assert abs(row.twist.twist.linear.x - 1.0) < 0.3


def test_a_publisher_that_comes_late_is_heard(start_fuser: StartFuser, peer: Peer) -> None:
    fuser = start_fuser()
    silence = 'waiting for odometry: /odom has 0 messages, no publisher'
    peer.until(lambda: peer.texts().get('estimator') == silence, fuser)
    assert peer.texts()['output'] == 'nothing on /odometry/filtered'
    peer.until(lambda: f'nothing is published: {silence}' in fuser.output, fuser)
    Drive(peer, fuser).connect().between(0.0, 40.0).until_row(39.0)
    peer.until(lambda: 'publishing /odometry/filtered' in fuser.output, fuser)
