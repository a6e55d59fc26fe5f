"""What the node publishes beside the odometry: acceleration, ground, events, numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING
from typing import Any

import pytest

rclpy = pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import AccelWithCovarianceStamped
from geometry_msgs.msg import PointStamped
from node.test_fuser import TWO_TOPICS
from node.test_fuser import fix
from node.test_fuser import odometry
from rcl_interfaces.msg import Log
from sensor_msgs.msg import Range

from ekf_fusion_ros.node.qos import events_qos

if TYPE_CHECKING:
    from fuser_process import Fuser
    from fuser_process import Peer

pytestmark = pytest.mark.slow


def hear(peer: Peer, kind: type, topic: str, qos: Any = 100) -> list[Any]:
    heard: list[Any] = []
    peer.node.create_subscription(kind, topic, heard.append, qos)
    return heard


def below(time_s: float) -> Range:
    """Return the ground at 1.5 m, as a sensor that looks down sees it."""
    message = Range(range=1.5, min_range=0.1, max_range=20.0, field_of_view=0.1)
    message.header.stamp = odometry(time_s).header.stamp
    message.header.frame_id = 'range'
    return message


def keys(message: DiagnosticArray) -> set[str]:
    return {value.key for value in message.status[0].values}


def test_acceleration_ground_events_and_numbers(
    start_fuser: Callable[..., Fuser], peer: Peer,
) -> None:
    fuser = start_fuser({'node.publish_acceleration': True, 'node.estimator_rate': 20.0,
                         'node.diagnostics_rate': 10.0, 'node.use_range': True})
    accelerations = hear(peer, AccelWithCovarianceStamped, 'accel/filtered')
    ground = hear(peer, PointStamped, 'terrain')
    numbers = hear(peer, DiagnosticArray, 'fuser/estimator')
    peer.connect(fuser, {**TWO_TOPICS, 'range': Range})
    for k in range(600):
        peer.publish('range', below(0.1 * k))
        peer.publish('odom', odometry(0.1 * k))
        if k % 2 == 0:
            peer.publish('fix', fix(0.1 * k))
        if k % 50 == 49:
            # a best-effort input keeps 200 messages: no faster than they are taken
            peer.until(lambda sent=k + 1: peer.count('odometry') >= sent, fuser)
    peer.until(lambda: bool(
        peer.odometry and accelerations and ground and numbers
        and 'test_ratio.gnss_position' in keys(numbers[-1])), fuser)
    # told before this subscription was there
    events = hear(peer, Log, 'fuser/events', events_qos())
    peer.until(lambda: any('origin set' in event.msg for event in events), fuser)
    assert {event.name for event in events} == {'fuser'}
    assert all(1000 <= event.stamp.sec < 1061 for event in events if event.stamp.sec)
    assert accelerations[-1].header.frame_id == 'base_link'
    assert abs(accelerations[-1].accel.accel.linear.x) < 1.0
    # it has not left the ground, of which it keeps clear by 0.1 m
    stamp = ground[-1].header.stamp
    peer.until(lambda: any(row.header.stamp == stamp for row in peer.odometry), fuser)
    (above,) = [row for row in peer.odometry if row.header.stamp == stamp]
    height = above.pose.pose.position.z - ground[-1].point.z
    assert height == pytest.approx(0.1, abs=0.01)
    assert ground[-1].header.frame_id == peer.odometry[-1].header.frame_id == 'map'
    values = {value.key: float(value.value) for value in numbers[-1].status[0].values}
    assert {'state.velocity.0', 'variance.position.2', 'test_ratio.gnss_position',
            'reset.position_ne'} <= set(values)
    assert values['state.velocity.1'] == pytest.approx(1.0, abs=0.3)
