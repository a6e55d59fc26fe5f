"""Where LPE takes its attitude from, and its own complementary filter."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.geo.magnetic_field import EclFieldTable
from ekf_fusion_ros.lpe.attitude import Attitude
from ekf_fusion_ros.lpe.lpe import Lpe
from ekf_fusion_ros.mathlib.rotation import euler_321
from ekf_fusion_ros.mathlib.rotation import matrix_from_euler_321
from ekf_fusion_ros.mathlib.rotation import quat_from_matrix
from ekf_fusion_ros.params.lpe import AttitudeParams
from ekf_fusion_ros.params.lpe import LpeParams
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import HeadingSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import VisionSample

START_US = 1_700_000_000_000_000
DT = 0.01
FIELD = np.array((0.21, 0.0, 0.43))
"""Horizontal part along magnetic north."""


def quaternion(roll=0.0, pitch=0.0, yaw=0.0):
    return quat_from_matrix(matrix_from_euler_321(roll, pitch, yaw))


class Body:
    """A body at a fixed attitude whose gyro may be biased, sampled at 100 Hz."""

    def __init__(self, params=None, roll=0.0, pitch=0.0, yaw=0.0, gyro=(0.0, 0.0, 0.0)):
        self.attitude = Attitude(params or AttitudeParams())
        self.rot = matrix_from_euler_321(roll, pitch, yaw)
        self.gyro = np.array(gyro)
        self.time_us = START_US

    def run(self, seconds, *, field=None, orientation=None, odometry=None):
        """Step; `field` NED, `orientation` (4,), `odometry` a function of the stamp."""
        for k in range(round(seconds / DT)):
            self.time_us += round(1e6 * DT)
            if field is not None:
                self.attitude.push_field(MagSample(self.time_us, self.rot.T @ field))
            if odometry is not None and k % 5 == 0:
                self.attitude.push_odometry(odometry(self.time_us))
            force = self.rot.T @ np.array((0.0, 0.0, -9.80665))
            self.attitude.step(ImuSample(
                self.time_us, self.gyro * DT, force * DT, DT, DT, orientation=orientation))
        return self

    def angles(self):
        return np.degrees(euler_321(self.attitude.rot))


def odometry_at(roll, pitch, yaw, resets=0):
    q = quaternion(roll, pitch, yaw)
    return lambda t: VisionSample(t, np.zeros(3), q, reset_counter=resets)


def test_the_filter_levels_at_the_first_force_and_waits_for_a_heading():
    body = Body(roll=0.2, pitch=-0.1, yaw=1.0).run(0.1)
    assert body.attitude.source == 'filter'
    assert body.angles()[:2] == pytest.approx(np.degrees((0.2, -0.1)), abs=0.1)
    assert not body.attitude.yaw_aligned
    assert body.attitude.covariance()[2, 2] > 1.0
    body.run(0.1, field=FIELD)
    assert body.attitude.yaw_aligned
    assert body.angles()[2] == pytest.approx(math.degrees(1.0), abs=0.5)
    assert body.attitude.covariance()[2, 2] < 0.01


def test_no_levelling_while_the_force_is_not_gravity():
    attitude = Attitude(AttitudeParams())
    attitude.step(ImuSample(START_US, np.zeros(3), np.array((0.0, 0.0, -14.0)) * DT, DT, DT))
    assert not attitude.ready


def test_the_gyro_bias_is_learned():
    body = Body(gyro=(0.01, -0.02, 0.015)).run(200.0, field=FIELD)
    assert body.attitude.gyro_bias == pytest.approx((0.01, -0.02, 0.015), abs=0.002)
    assert np.abs(body.angles()).max() < 1.0
    assert np.abs(body.attitude.rate).max() < 0.002


def test_the_gyro_bias_is_limited():
    body = Body(gyro=(0.08, 0.0, 0.0)).run(100.0, field=FIELD)
    assert body.attitude.gyro_bias[0] == AttitudeParams().gyro_bias_limit


def fix(time_us, **changes):
    return GnssSample(time_us, 47.4, 8.5, 500.0, 1.0, 2.0, **changes)


def test_the_declination_comes_from_the_table_with_the_first_fix():
    body = Body(yaw=0.5)
    body.run(0.1).attitude.push_fix(fix(body.time_us), 0)
    body.run(60.0, field=FIELD)
    declination = EclFieldTable.load().lookup(47.4, 8.5).declination
    assert body.angles()[2] == pytest.approx(math.degrees(0.5 + declination), abs=0.2)


def test_two_antennas_tell_yaw():
    body = Body(yaw=-2.0).run(0.1)
    body.attitude.push_fix(fix(body.time_us, yaw=-2.0, yaw_accuracy=0.02), 0)
    assert body.angles()[2] == pytest.approx(math.degrees(-2.0), abs=0.01)
    assert body.attitude.yaw_aligned


def test_a_known_acceleration_is_not_taken_for_tilt():
    def tilt(velocity_known):
        attitude = Attitude(AttitudeParams())
        rest, ahead = np.array((0.0, 0.0, -9.80665)), np.array((1.5, 0.0, -9.80665))
        for k in range(500):
            t = START_US + 10_000 * k
            if velocity_known and k % 20 == 0:
                attitude.push_fix(
                    fix(t, velocity=np.array((0.015 * k, 0.0, 0.0)), sacc=0.1), 0)
            force = ahead if k else rest
            attitude.step(ImuSample(t, np.zeros(3), force * DT, DT, DT))
        return abs(math.degrees(euler_321(attitude.rot)[1]))

    assert tilt(velocity_known=True) < 1.0
    assert tilt(velocity_known=False) > 4.0


def test_an_orientation_is_taken_as_it_is_and_before_all_else():
    told = quaternion(0.1, 0.2, 0.3)
    body = Body().run(1.0, orientation=told, odometry=odometry_at(0.0, 0.0, 2.0), field=FIELD)
    assert body.attitude.source == 'imu'
    assert body.attitude.yaw_aligned
    np.testing.assert_array_equal(body.attitude.quaternion, told)


def test_when_the_orientation_falls_silent_the_next_source_takes_over():
    body = Body().run(1.0, orientation=quaternion(0.0, 0.0, 0.3)).run(0.9)
    assert body.attitude.source == 'imu'
    body.run(0.2)
    assert body.attitude.source == 'filter'
    assert body.angles()[2] == pytest.approx(math.degrees(0.3), abs=0.1)


def test_the_tilt_of_the_odometry_counts_before_its_heading_is_known():
    body = Body().run(1.0, odometry=odometry_at(0.1, -0.2, 2.0))
    assert body.attitude.source == 'odometry'
    assert body.angles()[:2] == pytest.approx(np.degrees((0.1, -0.2)), abs=0.1)
    assert not body.attitude.yaw_aligned


def test_a_heading_of_the_odometry_turns_it_to_north():
    body = Body().run(1.0, odometry=odometry_at(0.1, -0.2, 2.0))
    body.attitude.push_heading(HeadingSample(body.time_us, -0.5, 0.01))
    body.run(0.2, odometry=odometry_at(0.1, -0.2, 2.0))
    assert body.attitude.yaw_aligned
    assert body.angles() == pytest.approx(np.degrees((0.1, -0.2, 1.5)), abs=0.1)
    assert body.attitude.jumps == 1
    assert body.attitude.covariance()[2, 2] == pytest.approx(0.01 + 0.05 ** 2)


def test_a_frame_that_says_it_has_turned_leaves_the_body():
    body = Body(AttitudeParams(odometry_yaw=True)).run(1.0, odometry=odometry_at(0.0, 0.0, 0.4))
    body.run(1.0, odometry=odometry_at(0.0, 0.0, -1.0, resets=1))
    assert body.angles()[2] == pytest.approx(math.degrees(0.4), abs=0.5)
    assert body.attitude.jumps == 0


def test_odometry_of_the_future_waits_for_inertial_time():
    body = Body(AttitudeParams(odometry_yaw=True)).run(0.1)
    sample = odometry_at(0.0, 0.0, 0.7)(body.time_us + 50_000)
    body.attitude.push_odometry(sample)
    body.run(0.04)
    assert body.attitude.source == 'filter'
    body.run(0.02)
    assert body.attitude.source == 'odometry'
    assert body.angles()[2] == pytest.approx(math.degrees(0.7), abs=0.1)


def test_odometry_of_the_past_is_turned_on_by_the_gyro():
    body = Body(AttitudeParams(odometry_yaw=True), gyro=(0.0, 0.0, 1.0)).run(0.1)
    body.attitude.push_odometry(odometry_at(0.0, 0.0, 0.7)(body.time_us - 90_000))
    body.run(DT)
    assert body.angles()[2] == pytest.approx(math.degrees(0.7 + 0.1), abs=0.3)


def test_a_source_that_was_asked_for_and_is_not_there_is_waited_for_in_words():
    lpe = Lpe(LpeParams(attitude=AttitudeParams(source='imu')))
    for k in range(100):
        lpe.push(ImuSample(START_US + 10_000 * k, np.zeros(3), np.array((0.0, 0.0, -0.0980665)),
                           DT, DT))
        assert lpe.update() is False
    assert lpe.nav_state() is None
    assert 'lpe.attitude.source: imu' in lpe.health().text


def test_odometry_without_attitude_is_no_source():
    sample = VisionSample(START_US, np.zeros(3), np.full(4, math.nan), velocity=NAN3)
    assert Attitude(AttitudeParams()).push_odometry(sample) is False
