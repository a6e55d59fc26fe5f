"""map -> odom times odom -> base_link is the fused pose, whichever of the two comes oftener."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.live.map_to_odom import SPAN_US
from ekf_fusion_ros.live.map_to_odom import MapToOdom
from ekf_fusion_ros.live.map_to_odom import PoseTrack
from ekf_fusion_ros.mathlib.rigid import Pose
from ekf_fusion_ros.mathlib.rigid import compose

SECOND = 1_000_000


def yaw_pose(x: float, y: float, yaw: float) -> Pose:
    return Pose(np.array((x, y, 0.0)),
                np.array((math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))))


def odometry_at(time_us: int) -> Pose:
    """A circle of 5 m in 20 s."""
    angle = 2.0 * math.pi * time_us / (20.0 * SECOND)
    return yaw_pose(5.0 * math.sin(angle), 5.0 - 5.0 * math.cos(angle), angle)


def fused_at(time_us: int) -> Pose:
    """The same circle in a map that lies elsewhere, with a drift."""
    return compose(yaw_pose(100.0 + 1e-7 * time_us, -3.0, 0.7), odometry_at(time_us))


def assert_same(first: Pose, second: Pose) -> None:
    np.testing.assert_allclose(first.position, second.position, atol=1e-9)
    assert abs(abs(first.quaternion @ second.quaternion) - 1.0) < 1e-12


def test_outputs_between_two_odometry_messages() -> None:
    """Two topics: each odometry message comes first, then the outputs up to its stamp."""
    relation = MapToOdom()
    for message in range(1, 20):
        end = message * SECOND // 10
        relation.odometry.push(end, odometry_at(end))
        for step in range(5):
            time_us = end - SECOND // 10 + (step + 1) * SECOND // 50
            relation.fused.push(time_us, fused_at(time_us))
            transform = relation.transform()
            if message == 1 and step < 4:
                assert transform is None
                continue
            assert transform is not None
            own = relation.odometry.at(time_us)
            assert own is not None
            assert_same(compose(transform, own), fused_at(time_us))


def test_outputs_ahead_of_the_odometry() -> None:
    """With an IMU: at the stamp of the last odometry message the product is the fused pose."""
    relation = MapToOdom()
    for step in range(1, 100):
        time_us = step * SECOND // 50
        relation.fused.push(time_us, fused_at(time_us))
        late = time_us - SECOND // 10
        if step % 5 == 0:
            relation.odometry.push(late + 7_000, odometry_at(late + 7_000))
        transform = relation.transform()
        if step < 10:
            continue
        newest = relation.odometry.newest_us
        assert transform is not None and newest is not None
        fused = relation.fused.at(newest)
        assert fused is not None
        assert_same(compose(transform, odometry_at(newest)), fused)


def test_the_last_transform_stays_while_the_odometry_is_silent() -> None:
    relation = MapToOdom()
    relation.odometry.push(SECOND, odometry_at(SECOND))
    relation.fused.push(SECOND, fused_at(SECOND))
    before = relation.transform()
    assert before is not None
    relation.fused.push(SECOND + 2 * SPAN_US, fused_at(SECOND + 2 * SPAN_US))
    assert relation.transform() is before


def test_a_track_forgets_what_is_old_and_what_stamps_contradict() -> None:
    track = PoseTrack()
    assert track.newest_us is None and track.at(0) is None
    for time_us in range(0, 4 * SECOND, SECOND // 10):
        track.push(time_us, odometry_at(time_us))
    assert track.at(SECOND) is None
    assert track.at(3 * SECOND + 50_000) is not None
    assert track.at(5 * SECOND) is None
    before = track.at(3 * SECOND)
    track.push(4 * SECOND - SECOND // 10, odometry_at(0))
    assert track.at(3 * SECOND) is before
    track.push(SECOND, odometry_at(SECOND))
    assert track.newest_us == SECOND
    assert track.at(3 * SECOND) is None


@pytest.mark.parametrize('first', ['fused', 'odometry'])
def test_one_track_alone_gives_nothing(first: str) -> None:
    relation = MapToOdom()
    getattr(relation, first).push(SECOND, odometry_at(SECOND))
    assert relation.transform() is None
