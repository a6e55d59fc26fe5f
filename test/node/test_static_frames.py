"""/tf_static in the node: what the filter waits for, and what it is told."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

rclpy = pytest.importorskip('rclpy')

from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import NavSatFix

from ekf_fusion_ros.node.static_frames import WAIT_S
from ekf_fusion_ros.node.static_frames import StaticFrames
from ekf_fusion_ros.params import Params


class Bench:
    """Static frames with a clock that is set; keeps mountings and warnings."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        monkeypatch.setattr(
            'ekf_fusion_ros.node.static_frames.time.monotonic', lambda: self.now)
        self.mounted: list[Any] = []
        self.warned: list[str] = []
        node = SimpleNamespace(get_logger=lambda: SimpleNamespace(warning=self.warned.append))
        self.frames = StaticFrames(
            node, Params(), SimpleNamespace(mount=self.mounted.append))  # type: ignore[arg-type]


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    return Bench(monkeypatch)


def fix_in(frame: str) -> NavSatFix:
    message = NavSatFix()
    message.header.frame_id = frame
    return message


def static(parent: str, child: str, x: float) -> Any:
    one = TransformStamped(child_frame_id=child)
    one.header.frame_id = parent
    one.transform.translation.x = x
    return SimpleNamespace(transforms=[one])


def test_the_filter_waits_until_the_frames_are_known(bench: Bench) -> None:
    assert not bench.frames.waits()
    bench.frames.note('odometry', Odometry(child_frame_id='base_link'))
    assert not bench.frames.waits()
    bench.frames.note('fix', fix_in('gps'))
    assert bench.frames.waits()
    bench.frames.hear(static('base_link', 'gps', 0.5))
    assert not bench.frames.waits()
    assert bench.mounted == [{'messages.fix.mount_xyz': (0.5, 0.0, 0.0)}]
    bench.frames.note('fix', fix_in('gps'))
    assert len(bench.mounted) == 1


def test_it_does_not_wait_for_long_and_says_what_is_missing(bench: Bench) -> None:
    bench.frames.note('fix', fix_in('gps'))
    bench.now += WAIT_S - 0.01
    assert bench.frames.waits()
    bench.now += 0.02
    assert not bench.frames.waits()
    assert ["does not tie its frame 'gps'" in line for line in bench.warned] == [True]
    assert not bench.frames.waits()
    assert len(bench.warned) == 1


def test_a_sensor_that_comes_later_stops_nothing(bench: Bench) -> None:
    bench.frames.note('odometry', Odometry(child_frame_id='camera'))
    bench.frames.hear(static('base_link', 'camera', 0.2))
    bench.now += 60.0
    bench.frames.note('fix', fix_in('gps'))
    assert not bench.frames.waits()
    assert bench.mounted == [{'messages.odometry.mount_xyz': (0.2, 0.0, 0.0)}]
    assert len(bench.warned) == 1
