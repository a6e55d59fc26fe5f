"""Which range samples are believed: the judge alone, fed period by period."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.ekf2.aid_sources.range_finder import RangeFinder
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.mathlib.rotation import matrix_from_euler_321
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import RangeParams
from ekf_fusion_ros.samples import RangeSample

STEP_US = 10_000
INTERVAL_US = 100_000


class Rig:
    """A finder that gets a sample every tenth of a second."""

    def __init__(self, **params) -> None:
        self.filter = Filter(Ekf2Params(range=RangeParams(**params)), 12)
        self.finder = RangeFinder(self.filter, 9)
        self.sample = RangeSample(0, 1.0, 100)
        self.now_us = 0
        self.interval_us = INTERVAL_US
        self.were_valid: list[bool] = []

    def run(self, seconds: float) -> bool:
        """Let time pass; True where the finder is believed at its end."""
        for _ in range(round(seconds * 1e6 / STEP_US)):
            self.now_us += STEP_US
            if self.interval_us and self.now_us % self.interval_us == 0:
                self.finder.push(self.sample._replace(time_us=self.now_us), 0)
            self.filter.t_horizon = self.filter.t_now = self.now_us
            self.finder.pop()
            self.were_valid.append(self.finder.valid)
        return self.finder.valid

    def see(self, distance: float, quality: int = 100) -> None:
        self.sample = self.sample._replace(distance=distance, quality=quality)

    def lean(self, roll: float, pitch: float, yaw: float = 0.4) -> None:
        self.filter.rot = matrix_from_euler_321(roll, pitch, yaw)


@pytest.fixture
def rig():
    rig = Rig()
    assert rig.run(3.0)
    return rig


def test_good_samples_are_believed_between_their_arrivals(rig):
    rig.were_valid.clear()
    rig.run(2.0)
    assert all(rig.were_valid)


def test_only_the_step_that_takes_a_sample_calls_it_fresh(rig):
    fresh = []
    for _ in range(100):
        rig.run(0.01)
        fresh.append(rig.finder.fresh)
    assert sum(fresh) == 10


@pytest.mark.parametrize('yaw', [0.0, 2.0, -2.5])
@pytest.mark.parametrize('axis', [0, 1])
def test_tilt_beyond_45_degrees_is_not_believed(rig, axis, yaw):
    for degrees, believed in ((0, True), (40, True), (44, True), (46, False), (70, False),
                              (-44, True), (-46, False), (135, False), (180, False)):
        angles = [0.0, 0.0]
        angles[axis] = math.radians(degrees)
        rig.lean(*angles, yaw)
        assert rig.run(0.2) is believed, degrees


def test_roll_and_pitch_add_up(rig):
    # cos 35 cos 35 = 0.67 < 0.707: each alone would do.
    rig.lean(math.radians(35.0), math.radians(35.0))
    assert not rig.run(0.2)


def test_a_tilted_mounting_moves_the_limit():
    rig = Rig(pitch=math.radians(20.0))
    assert rig.run(3.0)
    rig.lean(0.0, math.radians(30.0))
    assert not rig.run(0.2)
    rig.lean(0.0, math.radians(-60.0))
    assert rig.run(0.2)
    # 1 m along an axis 40 degrees from down.
    assert rig.finder.height == pytest.approx(math.cos(math.radians(40.0)))


@pytest.mark.parametrize(('distance', 'believed'), [
    (0.15, False), (0.25, True), (19.9, True), (20.1, False)])
def test_limits_of_the_sensor(rig, distance, believed):
    rig.see(distance)
    assert rig.run(0.2) is believed


def test_a_sample_serves_for_four_tenths_of_a_second(rig):
    rig.interval_us = 0
    # the last sample is 5 ms of half a period and 5 ms of delay old when it is taken
    assert rig.run(0.35)
    assert not rig.run(0.10)
    assert not rig.finder.regular


def test_bad_quality_is_forgiven_after_a_second(rig):
    rig.see(1.0, quality=0)
    assert not rig.run(0.2)
    rig.see(1.0)
    assert not rig.run(0.9)
    assert rig.run(0.3)


def test_unknown_quality_is_good(rig):
    rig.see(1.0, quality=-1)
    assert rig.run(0.2)


def test_a_stuck_sensor_must_move_to_be_believed_again(rig):
    rig.see(1.0, quality=0)
    rig.run(11.0)
    rig.see(5.0)
    assert not rig.run(5.0)
    for distance in (5.05, 5.2, 5.3):
        rig.see(distance)
        rig.run(0.2)
    assert rig.finder.valid


def test_after_a_short_outage_the_same_distance_is_believed(rig):
    rig.see(1.0, quality=0)
    rig.run(8.0)
    rig.see(5.0)
    assert rig.run(1.5)


def test_rare_samples_are_not_believed_until_they_come_regularly(rig):
    rig.interval_us = 6_000_000
    rig.run(30.0)
    rig.were_valid.clear()
    rig.interval_us = INTERVAL_US
    assert not rig.run(0.3)
    for k in range(30):
        rig.see(1.0 + 0.01 * k)
        rig.run(0.2)
    assert rig.finder.valid


@pytest.mark.parametrize('roll', [-0.6, 0.0, 0.5])
@pytest.mark.parametrize('pitch', [-0.3, 0.4])
def test_height_is_the_vertical_part(rig, roll, pitch):
    rig.lean(roll, pitch)
    rig.see(7.0)
    assert rig.run(0.2)
    down_in_body = np.array((-math.sin(pitch), math.sin(roll) * math.cos(pitch),
                             math.cos(roll) * math.cos(pitch)))
    assert rig.finder.height == pytest.approx(7.0 * down_in_body[2], rel=1e-9)


def test_distance_is_that_of_the_imu():
    rig = Rig(position=(0.5, 0.0, 0.3))
    rig.lean(0.0, math.radians(-30.0))
    rig.see(2.0)
    assert rig.run(3.0)
    # pitched down by 30 degrees, a sensor ahead and below is lower by 0.5 s + 0.3 c
    lower = 0.5 * math.sin(math.radians(30.0)) + 0.3 * math.cos(math.radians(30.0))
    assert rig.finder.height == pytest.approx(2.0 * math.cos(math.radians(30.0)) + lower)
