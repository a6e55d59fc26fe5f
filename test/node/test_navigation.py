"""Home and flags on topics, in the process of the test."""

from __future__ import annotations

from collections.abc import Callable
import time
from typing import Any

import pytest

rclpy = pytest.importorskip('rclpy')

from geometry_msgs.msg import PoseStamped
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import NavSatFix
from std_msgs.msg import Bool

from ekf_fusion_ros.health.home import Home
from ekf_fusion_ros.health.status import NavigationStatus
from ekf_fusion_ros.node.navigation import NavigationPublisher
from ekf_fusion_ros.node.qos import latched_qos
from ekf_fusion_ros.params.tree import Params

HOME = Home(1_500_000, 47.0, 8.0, 400.0, 3.0, 4.0, -5.0, 0.0)
GOOD = NavigationStatus(
    2_000_000, global_position_valid=True, local_position_valid=True, local_velocity_valid=True,
    home=HOME, ready=True)


@pytest.fixture
def until() -> Any:
    """A node, and a function that serves it until a condition holds."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node('navigation_test', context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def serve(condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + 60.0
        while not condition():
            assert time.monotonic() < deadline
            executor.spin_once(timeout_sec=0.05)

    yield node, serve
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown(context=context)


def listen(node: Any, kind: type, topic: str) -> list[Any]:
    heard: list[Any] = []
    node.create_subscription(kind, topic, heard.append, latched_qos())
    return heard


def test_a_late_subscriber_gets_home_and_flags(until: Any) -> None:
    node, serve = until
    NavigationPublisher(node, Params()).publish(GOOD)
    fixes, poses = listen(node, NavSatFix, 'home'), listen(node, PoseStamped, 'home/pose')
    ready = listen(node, Bool, 'navigation/ready')
    serve(lambda: bool(fixes and poses and ready))
    assert (fixes[0].latitude, fixes[0].longitude, fixes[0].altitude) == (47.0, 8.0, 400.0)
    assert fixes[0].header.stamp.sec == 1 and fixes[0].header.stamp.nanosec == 500_000_000
    place = poses[0].pose.position
    assert (place.x, place.y, place.z) == (4.0, 3.0, 5.0)
    assert poses[0].header.frame_id == 'map'
    assert ready[0].data is True


def test_only_changes_are_published_and_silence_clears_the_flags(
    until: Any, monkeypatch: pytest.MonkeyPatch,
) -> None:
    node, _ = until
    clock = [100.0]
    monkeypatch.setattr('ekf_fusion_ros.node.navigation.time.monotonic', lambda: clock[0])
    publisher = NavigationPublisher(node, Params())
    sent: list[bool] = []
    publisher._flags['global_position_valid'].publish = lambda message: sent.append(message.data)
    publisher.publish(GOOD)
    publisher.publish(GOOD)
    clock[0] += 1.0
    publisher.publish(GOOD)
    assert sent == [True]
    clock[0] += 0.001
    publisher.publish(GOOD)
    assert sent == [True, False]
