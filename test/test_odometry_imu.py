"""Odometry as inertial input."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.odometry_imu import OdometryImu
from ekf_fusion_ros.params.two_topic import TwoTopicParams
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import NAN4
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.samples import VisionSample

GRAVITY = 9.80665
LEVEL = np.array((1.0, 0.0, 0.0, 0.0))


def odometry(time_us, position=NAN3, quaternion=NAN4, velocity=NAN3, **more):
    """Return a sample whose velocity is in the body frame unless told otherwise."""
    more.setdefault('velocity_frame', VelocityFrame.BODY_FRD)
    return VisionSample(
        time_us, np.array(position, float), np.array(quaternion, float),
        np.array(velocity, float), **more)


def yawed(angle):
    return np.array((math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)))


@pytest.fixture
def source():
    return OdometryImu(TwoTopicParams())


def test_at_rest_the_increments_are_gravity(source):
    source.push(odometry(0, (1, 2, 3), LEVEL, (0, 0, 0)))
    increments = source.push(odometry(98_000, (1, 2, 3), LEVEL, (0, 0, 0)))
    stamps = [sample.time_us for sample in increments]
    assert stamps[0] > 0
    assert stamps == sorted(set(stamps))
    assert stamps[-1] == 98_000
    assert max(np.diff([0, *stamps])) <= 10_000
    assert sum(sample.delta_velocity_dt for sample in increments) == pytest.approx(0.098)
    for sample in increments:
        assert sample.delta_angle == pytest.approx(np.zeros(3), abs=1e-15)
        assert sample.delta_velocity == pytest.approx(
            (0, 0, -GRAVITY * sample.delta_velocity_dt), abs=1e-12)


def test_a_strapdown_meets_attitude_and_velocity_of_every_message(source):
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    times = np.arange(0.0, 6.0, 0.13)
    truth = rotation.from_euler('ZYX', np.stack(
        [0.7 * times, 0.2 * np.sin(times), 0.3 * np.sin(1.7 * times)], axis=1))
    body = np.stack([2.0 + np.sin(times), 0.3 * np.cos(2 * times), 0.1 * np.sin(times)], axis=1)
    attitude, velocity = truth[0], truth[0].apply(body[0])
    for k, time in enumerate(times):
        message = odometry(
            round(1e6 * time), NAN3, truth[k].as_quat()[[3, 0, 1, 2]], body[k])
        for imu in source.push(message):
            half = rotation.from_rotvec(0.5 * imu.delta_angle)
            velocity = velocity + (attitude * half).apply(imu.delta_velocity)
            velocity = velocity + np.array((0, 0, GRAVITY)) * imu.delta_velocity_dt
            attitude = attitude * half * half
        assert (attitude.inv() * truth[k]).magnitude() < 1e-9
        # Constant acceleration in steps of 10 ms under rotation: second order small.
        assert velocity == pytest.approx(truth[k].apply(body[k]), abs=2e-3)
    assert not source.jumps


def test_fast_odometry_gives_one_increment_a_message(source):
    source.push(odometry(0, (0, 0, 0), LEVEL, (1, 0, 0)))
    for k in range(1, 50):
        assert len(source.push(odometry(5000 * k, (0.005 * k, 0, 0), LEVEL, (1, 0, 0)))) == 1


def test_a_velocity_in_the_local_frame_is_turned_into_the_body_frame(source):
    east = odometry(0, (0, 0, 0), yawed(math.pi / 2), (0, 3, 0),
                    velocity_frame=VelocityFrame.LOCAL_FRD)
    source.push(east)
    fused = source.fused()
    assert fused.velocity_frame is VelocityFrame.BODY_FRD
    assert fused.velocity == pytest.approx((3, 0, 0), abs=1e-12)


def test_positions_alone_give_velocity_along_the_axes_of_the_odometry(source):
    for k in range(30):
        increments = source.push(odometry(200_000 * k, (0.4 * k * 0.2, -0.3 * k * 0.2, math.nan)))
    fused = source.fused()
    assert fused.quaternion == pytest.approx(LEVEL)
    assert fused.velocity == pytest.approx((0.4, -0.3, 0.0), abs=1e-6)
    assert np.isfinite(fused.velocity_cov).all()
    assert increments[-1].delta_angle == pytest.approx(np.zeros(3))


def test_fast_motion_from_the_first_positions_on_is_no_endless_jump(source):
    for k in range(20):
        source.push(odometry(200_000 * k, (25.0 * 0.2 * k, 0, 0)))
    assert source.fused().velocity == pytest.approx((25, 0, 0), abs=0.01)


@pytest.mark.parametrize('has_velocity', [True, False])
def test_a_jump_of_the_frame_is_counted_and_leaves_the_increments_smooth(source, has_velocity):
    def push(k, place, attitude):
        speed = (1, 0, 0) if has_velocity else NAN3
        return source.push(odometry(100_000 * k, place, attitude, speed))

    for k in range(20):
        push(k, (0.1 * k, 0, 0), LEVEL)
    # The frame turns by 2 rad and moves by 50 m between two messages.
    turn, angle, change = np.array((math.cos(2), math.sin(2), 0)), np.zeros(3), np.zeros(3)
    for k in range(20, 40):
        for imu in push(k, (50, 50, 0) + 0.1 * (k - 20) * turn, yawed(2.0)):
            angle += imu.delta_angle
            change += imu.delta_velocity + np.array((0, 0, GRAVITY)) * imu.delta_velocity_dt
    assert np.linalg.norm(angle) < 1e-9
    assert np.linalg.norm(change) < 0.05
    assert source.jumps['attitude'] == 1
    assert source.jumps['position'] == 1


def test_a_stamp_that_does_not_advance_is_counted(source):
    source.push(odometry(1000, (0, 0, 0), LEVEL, (0, 0, 0)))
    assert source.push(odometry(1000, (0, 0, 0), LEVEL, (0, 0, 0))) == []
    assert source.push(odometry(900, (0, 0, 0), LEVEL, (0, 0, 0))) == []
    assert source.jumps['stamp'] == 2


def test_an_impossible_change_of_velocity_is_limited(source):
    source.push(odometry(0, NAN3, LEVEL, (0, 0, 0)))
    increments = source.push(odometry(10_000, NAN3, LEVEL, (100, 0, 0)))
    params = TwoTopicParams().odometry
    limit = params.max_acceleration * 0.01 + params.jump_speed
    assert increments[0].delta_velocity[0] == pytest.approx(limit)
    assert source.jumps['velocity'] == 1


def test_covariance_of_velocity_has_a_floor_and_keeps_what_exceeds_it(source):
    floor = TwoTopicParams().odometry.velocity_noise ** 2
    source.push(odometry(0, NAN3, LEVEL, (1, 0, 0), velocity_cov=np.diag((1e-6, 4.0, math.nan))))
    assert np.diag(source.fused().velocity_cov) == pytest.approx((floor, 4.0, floor))


def test_a_session_tells_when_the_odometry_frame_jumps():
    from ekf_fusion_ros.params.tree import Params
    from ekf_fusion_ros.session import FusionSession
    session = FusionSession(Params(), ('odometry', 'fix'))
    for k in range(40):
        place = (0.1 * k + (70.0 if k >= 20 else 0.0), 0, 0)
        session.push(odometry(1_000_000 + 100_000 * k, place, LEVEL, (1, 0, 0)))
    told = [event.text for event in session.drain_events() if 'jumped' in event.text]
    assert len(told) == 1
    assert 'position of the odometry' in told[0]


def test_without_an_attitude_the_positions_tell_the_direction(source):
    """The body goes 2 m/s ahead and turns: down the y axis of the frame, which it does not say."""
    for k in range(100):
        source.push(odometry(50_000 * k, (0.0, 0.1 * k, 0.0), NAN4, (2.0, 0.0, 0.0)))
    assert source.fused().velocity == pytest.approx((0.0, 2.0, 0.0), abs=1e-6)


def test_a_frame_that_has_moved_over_a_gap_may_have_turned(source):
    """The body turns at 0.1 rad/s; in 3 s of silence its source restarts, turned by 2 rad."""
    turned = np.zeros(3)
    for k in range(40):
        later, new = (3.0, 1) if k >= 20 else (0.0, 0)
        time = 0.1 * k + later
        place = (100.0 * new, 50.0 * new, 0.0)
        attitude = yawed(0.1 * time + 2.0 * new)
        for imu in source.push(odometry(round(1e6 * time), place, attitude, (0.0, 0.0, 0.0))):
            turned += imu.delta_angle
    assert source.jumps['position'] == 1
    assert turned == pytest.approx((0.0, 0.0, 0.1 * (3.9 + 3.0)), abs=0.02)
