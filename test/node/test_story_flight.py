"""What the node tells along a flight by IMU: alignment, GNSS and its loss, by both estimators."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import re
from typing import TYPE_CHECKING
from typing import Any

import pytest

rclpy = pytest.importorskip('rclpy')

from geometry_msgs.msg import TwistStamped
from geometry_msgs.msg import Vector3Stamped
from node.test_company import below
from node.test_fuser import fix
from node.test_fuser import odometry
from node.test_life import events_of
from node.test_life import told
from node.test_story import inertial
from node.test_story import state
from sensor_msgs.msg import Imu
from sensor_msgs.msg import MagneticField
from sensor_msgs.msg import NavSatFix
from sensor_msgs.msg import Range
from std_msgs.msg import Bool

from ekf_fusion_ros.estimator import HealthLevel

if TYPE_CHECKING:
    from fuser_process import Fuser
    from fuser_process import Peer

pytestmark = pytest.mark.slow
StartFuser = Callable[..., 'Fuser']
BATCH = 25
LONGEST = 6000
"""Hundredths of a second: sent at once, and of a flight."""


def stamped(kind: type, time_s: float) -> Any:
    message = kind()
    message.header.stamp = odometry(time_s).header.stamp
    message.header.frame_id = 'base_link'
    return message


def field(time_s: float) -> MagneticField:
    """Return the field where the nose points east."""
    message = stamped(MagneticField, time_s)
    message.magnetic_field.y, message.magnetic_field.z = 21e-6, -43e-6
    return message


def flow(time_s: float) -> Vector3Stamped:
    """Return the scene 1.6 m below at 1 m/s."""
    message = stamped(Vector3Stamped, time_s)
    message.vector.y, message.vector.z = 1.0 / 1.6, 1.0
    return message


def far_fix(time_s: float) -> NavSatFix:
    """Return a fix that is 1.1 km off."""
    message = fix(time_s)
    message.latitude += 0.01
    return message


def eastward(time_s: float, speed: float = 1.0) -> TwistStamped:
    message = stamped(TwistStamped, time_s)
    message.twist.linear.x = speed
    return message


def lost(time_s: float) -> Imu:
    """Return what an IMU measures that knows no orientation."""
    message = inertial(time_s)
    message.orientation_covariance[0] = -1.0
    return message


def oriented(time_s: float) -> Imu:
    """Return the same with an orientation."""
    message = inertial(time_s)
    message.orientation.w = 1.0
    message.orientation_covariance[::4] = 1e-4
    return message


class Flight:
    """Flies along x with an IMU at 100 Hz and what `senders` give.

    senders: by topic the interval in hundredths of a second, and the message of a time.
    """

    def __init__(self, peer: Peer, fuser: Fuser, topics: dict[str, type]) -> None:
        self.peer = peer
        self.fuser = fuser
        self.senders: dict[str, tuple[int, Callable[[float], Any]]] = {'imu': (1, inertial)}
        self._step = 0
        peer.connect(fuser, topics)

    def until(self, condition: Callable[[], bool]) -> None:
        """Fly on until something is so."""
        while not condition():
            assert self._step < LONGEST, self.peer.texts()
            begin, self._step = self._step, self._step + BATCH
            for step in range(begin, self._step):
                for topic, (every, message) in self.senders.items():
                    if step % every == 0:
                        self.peer.publish(topic, message(0.01 * step))
            self.peer.until(lambda: self.peer.count('imu') >= self._step, self.fuser)

    def until_told(self, pattern: str, level: HealthLevel) -> None:
        """Fly on until the sentence of state is one."""
        self.until(lambda: re.match(pattern, state(self.peer)) is not None)
        assert ord(self.peer.reports['estimator'].level) == level


def test_ekf2_from_the_first_sample_to_the_loss_of_gnss(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    roles = 'imu', 'magnetic_field', 'range', 'flow'
    fuser = start_fuser({
        'node.use_odometry': False, **{f'node.use_{role}': True for role in roles}})
    events = events_of(peer)
    flight = Flight(peer, fuser, {
        'imu': Imu, 'fix': NavSatFix, 'mag': MagneticField, 'range': Range,
        'flow': Vector3Stamped})
    flight.senders |= {
        'fix': (20, fix), 'mag': (10, field), 'range': (10, below), 'flow': (10, flow)}
    for sentence in ('gathering samples for the initial alignment: not enough samples of the ',
                     'aligning tilt$', 'waiting for the GNSS checks to pass$'):
        flight.until_told(sentence, HealthLevel.WARN)
    flight.until_told('ok: fusing GNSS, .*optical flow', HealthLevel.OK)
    del flight.senders['fix']
    flight.until_told('GNSS not used; fusing .*optical flow', HealthLevel.WARN)
    for words in ('tilt aligned', 'yaw aligned', 'GNSS checks passed, origin set: 47.0',
                  'started GNSS fusion', 'GNSS data stopped; another source aids'):
        peer.until(lambda words=words: told(events, words) and words in fuser.output, fuser)


def test_lpe_from_the_first_sample_to_the_loss_of_gnss(
    start_fuser: StartFuser, peer: Peer,
) -> None:
    """Attitude comes late, fixes are wrong for a while, the vehicle is said to be landed."""
    fuser = start_fuser({
        'estimator': 'lpe', 'lpe.attitude.source': 'imu', 'node.use_odometry': False,
        'node.use_imu': True, 'node.use_landed': True, 'node.use_fix_velocity': True,
        'node.fix_velocity_type': 'twist'})
    events = events_of(peer)
    flight = Flight(peer, fuser, {
        'imu': Imu, 'fix': NavSatFix, 'fix_velocity': TwistStamped, 'landed': Bool})

    def hears(words: str) -> None:
        flight.until(lambda: told(events, words) and words in fuser.output)

    flight.senders |= {
        'imu': (1, lost), 'fix': (20, fix), 'fix_velocity': (20, eastward)}
    flight.until_told(r'waiting for attitude \(lpe.attitude.source: imu\)', HealthLevel.WARN)
    flight.senders['imu'] = 1, oriented
    flight.until_told('no sensor of horizontal position or velocity', HealthLevel.WARN)
    flight.until_told('ok: fusing gnss', HealthLevel.OK)
    for words in ('fixes are good, origin set', 'gnss initialised'):
        hears(words)
    flight.senders['fix'] = 20, far_fix
    flight.until_told('gnss contradict the estimate', HealthLevel.WARN)
    hears('gnss contradicts the estimate')
    flight.senders['fix'] = 20, fix
    hears('gnss agrees with the estimate again')
    flight.senders['fix_velocity'] = 20, partial(eastward, speed=3.0)
    peer.publish('landed', Bool(data=True))
    hears('said to be landed while the fixes travel: not believed')
    peer.publish('landed', Bool(data=False))
    del flight.senders['fix']
    flight.until_told('no sensor of horizontal position or velocity', HealthLevel.ERROR)
    hears('gnss timed out')
