"""The queue keeps the order of arrival and turns away what does not fit."""

from __future__ import annotations

import pytest

from ekf_fusion_ros.node.intake import Intake


def test_arrivals_leave_in_order_across_roles() -> None:
    intake = Intake(10)
    arrivals = [('imu', 1), ('fix', 2), ('imu', 3), ('odometry', 4)]
    assert all(intake.put(role, message) for role, message in arrivals)
    assert [intake.take() for _ in arrivals] == arrivals


def test_full_queue_turns_the_newest_away() -> None:
    intake = Intake(2)
    assert [intake.put('imu', number) for number in range(4)] == [True, True, False, False]
    assert len(intake) == 2
    assert intake.take() == ('imu', 0)
    assert intake.put('imu', 9)
    assert [intake.take(), intake.take()] == [('imu', 1), ('imu', 9)]


def test_empty_queue_raises() -> None:
    with pytest.raises(IndexError):
        Intake(1).take()
