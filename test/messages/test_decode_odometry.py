"""Odometry: MAVROS's conversion, what counts as measured, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.messages.decode_odometry import decode_odometry
from ekf_fusion_ros.messages.decode_odometry import has_true_heading
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.params.messages import OdometryMessageParams
from ekf_fusion_ros.samples import VelocityFrame

PARAMS = MessageParams()
HALF_SQRT = math.sqrt(0.5)
HUGE = 1e6


def with_odometry(**changes):
    return MessageParams(odometry=OdometryMessageParams(**changes))


def test_enu_flu_becomes_ned_frd(build):
    message = build.odometry(
        pose_var=(1.0, 2.0, 3.0, 0.1, 0.2, 0.3), twist_var=(4.0, 5.0, 6.0, 0, 0, 0))
    message.pose.covariance[6 * 0 + 2] = message.pose.covariance[6 * 2 + 0] = 0.5
    message.twist.covariance[6 * 0 + 1] = message.twist.covariance[6 * 1 + 0] = 0.5
    sample = decode_odometry(message, PARAMS)
    assert sample.time_us == 100_250_000
    assert sample.position.tolist() == [2.0, 1.0, -3.0]
    assert sample.position_var.tolist() == [2.0, 1.0, 3.0]
    assert sample.velocity.tolist() == [0.5, 0.25, -0.125]
    assert sample.velocity_cov.tolist() == [[4.0, -0.5, 0.0], [-0.5, 5.0, 0.0], [0.0, 0.0, 6.0]]
    # Nose along x of the odometry frame, "east": 90 deg from its "north".
    assert sample.quaternion == pytest.approx((HALF_SQRT, 0.0, 0.0, HALF_SQRT), abs=1e-15)
    assert sample.angular_var == 0.3
    assert sample.velocity_frame is VelocityFrame.BODY_FRD


def test_ned_frd_names_pass_as_identity(build):
    message = build.odometry(
        'odom_ned', 'base_link_frd', (1.0, 2.0, 3.0, 0.1, 0.2, 0.3), (4.0, 5.0, 6.0, 0, 0, 0))
    message.pose.pose.orientation = build.quaternion(0.5, 0.5, -0.5, 0.5)
    sample = decode_odometry(message, PARAMS)
    assert sample.position.tolist() == [1.0, 2.0, 3.0]
    assert sample.position_var.tolist() == [1.0, 2.0, 3.0]
    assert sample.quaternion.tolist() == [0.5, 0.5, -0.5, 0.5]
    assert sample.velocity.tolist() == [0.5, -0.25, 0.125]
    assert np.diag(sample.velocity_cov).tolist() == [4.0, 5.0, 6.0]


def test_parent_and_child_are_judged_on_their_own(build):
    body_down = decode_odometry(build.odometry('odom', 'base_link_frd'), PARAMS)
    assert body_down.position.tolist() == [2.0, 1.0, -3.0]
    assert body_down.velocity.tolist() == [0.5, -0.25, 0.125]
    # MAVROS: identity from FRD to ENU is the static transform map -> map_ned, up to sign.
    assert np.abs(body_down.quaternion) == pytest.approx((0.0, HALF_SQRT, HALF_SQRT, 0.0))
    earth_down = decode_odometry(build.odometry('odom_ned', 'base_link'), PARAMS)
    assert earth_down.position.tolist() == [1.0, 2.0, 3.0]
    assert earth_down.velocity.tolist() == [0.5, 0.25, -0.125]
    assert np.abs(earth_down.quaternion).tolist() == [0.0, 1.0, 0.0, 0.0]


@pytest.mark.parametrize(('configured', 'parent', 'fits'), [
    ('auto', 'odom', True), ('auto', 'odom_ned', True), ('enu', 'map', True),
    ('ned', 'map_ned', True), ('frd', 'odom_frd', True), ('enu', 'odom_ned', False),
    ('ned', 'odom', False), ('ned', 'odom_frd', False), ('frd', 'odom_ned', False),
])
def test_frame_against_the_configured_one(build, configured, parent, fits):
    message = build.odometry(parent)
    params = with_odometry(frame=configured)
    if fits:
        assert decode_odometry(message, params).has_position
        return
    with pytest.raises(Refused, match=parent) as refused:
        decode_odometry(message, params)
    assert refused.value.reason == 'frame_contradiction'


def test_true_heading_is_declared_never_assumed():
    assert not has_true_heading(OdometryMessageParams())
    assert not has_true_heading(OdometryMessageParams(frame='frd'))
    assert has_true_heading(OdometryMessageParams(frame='ned'))
    assert has_true_heading(OdometryMessageParams(true_heading=True))


def test_mounting_turns_twist_and_attitude_like_scipy(build):
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    rpy = (0.3, -0.2, 1.1)
    # In ENU/FLU: the sensor's attitude is the body's times the mounting.
    body_to_enu = rotation.from_euler('xyz', (0.1, 0.4, -2.0))
    mounting = rotation.from_euler('xyz', rpy)
    x, y, z, w = (body_to_enu * mounting).as_quat()
    message = build.odometry(twist_var=(1.0, 2.0, 3.0, 0, 0, 0))
    message.pose.pose.orientation = build.quaternion(w, x, y, z)
    sample = decode_odometry(message, with_odometry(mount_rpy=rpy))
    enu_to_ned = rotation.from_euler('xyz', (math.pi, 0.0, math.pi / 2))
    flip = np.diag((1.0, -1.0, -1.0))
    expected = enu_to_ned.as_matrix() @ body_to_enu.as_matrix() @ flip
    got = rotation.from_quat(np.roll(sample.quaternion, -1)).as_matrix()
    assert got == pytest.approx(expected, abs=1e-14)
    turn = flip @ mounting.as_matrix()
    assert sample.velocity == pytest.approx(turn @ (0.5, -0.25, 0.125), abs=1e-15)
    assert sample.velocity_cov == pytest.approx(turn @ np.diag((1, 2, 3)) @ turn.T, abs=1e-14)


@pytest.mark.parametrize(('parent', 'child'), [('world', 'body'), ('odom_ned', 'base_link_frd')])
def test_twist_along_the_axes_of_the_parent_is_turned_into_the_body(build, parent, child):
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    attitude = rotation.from_euler('xyz', (0.1, 0.4, -2.0))
    x, y, z, w = attitude.as_quat()
    message = build.odometry(parent, child, twist_var=(1.0, 2.0, 3.0, 0, 0, 0))
    message.pose.pose.orientation = build.quaternion(w, x, y, z)
    in_child = attitude.inv().as_matrix()
    flip = np.diag((1.0, -1.0, -1.0)) if parent == 'world' else np.eye(3)
    sample = decode_odometry(message, with_odometry(twist_frame='parent'))
    assert sample.velocity == pytest.approx(flip @ in_child @ (0.5, -0.25, 0.125), abs=1e-15)
    covariance = in_child @ np.diag((1.0, 2.0, 3.0)) @ in_child.T
    assert sample.velocity_cov == pytest.approx(flip @ covariance @ flip, abs=1e-14)


def test_twist_along_the_axes_of_the_parent_needs_the_orientation(build):
    message = build.odometry(pose_var=(0.1, 0.1, 0.1, HUGE, HUGE, HUGE))
    params = with_odometry(twist_frame='parent')
    assert not decode_odometry(message, params).has_velocity
    assert decode_odometry(message, params).has_position


def test_unknown_climb_of_the_parent_is_no_known_climb_of_the_body(build):
    message = build.odometry(twist_var=(0.1, 0.1, HUGE, 0, 0, 0))
    sample = decode_odometry(message, with_odometry(twist_frame='parent'))
    assert sample.velocity_cov[2, 2] > 1e4
    assert np.diag(sample.velocity_cov)[0:2] == pytest.approx((0.1, 0.1))


def test_zero_covariance_means_unknown(build):
    sample = decode_odometry(build.odometry(pose_var=(0,) * 6, twist_var=(0,) * 6), with_odometry(
        position_noise=0.5, velocity_noise=0.2, yaw_noise=0.3))
    assert sample.position_var == pytest.approx((0.25,) * 3)
    assert sample.velocity_cov == pytest.approx(0.04 * np.eye(3))
    assert sample.angular_var == pytest.approx(0.09)
    assert np.isfinite(sample.position).all()


@pytest.mark.parametrize('unmeasured', [0.0, HUGE, 99999.0, math.inf])
def test_planar_odometry_keeps_x_y_yaw_and_forward_speed(build, unmeasured):
    u = unmeasured
    message = build.odometry(pose_var=(0.1, 0.2, u, u, u, 0.03), twist_var=(0.5, u, u, u, u, 0.1))
    half = 0.25
    message.pose.pose.orientation = build.quaternion(math.cos(half), 0.0, 0.0, math.sin(half))
    sample = decode_odometry(message, with_odometry(lateral_velocity_noise=0.4))
    assert sample.position[:2].tolist() == [2.0, 1.0]
    assert math.isnan(sample.position[2])
    assert sample.position_var[:2].tolist() == [0.2, 0.1]
    w, x, y, z = sample.quaternion
    assert (x, y) == (0.0, 0.0)
    assert 2 * math.atan2(z, w) == pytest.approx(math.pi / 2 - 0.5)
    assert sample.velocity.tolist() == [0.5, 0.0, 0.0]
    assert np.diag(sample.velocity_cov) == pytest.approx((0.5, 0.16, 0.16))
    assert sample.angular_var == 0.03


def test_unmeasured_tilt_leaves_the_yaw_level(build):
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    x, y, z, w = rotation.from_euler('ZYX', (0.7, 0.2, -0.4)).as_quat()
    message = build.odometry(pose_var=(0.1, 0.1, 0.1, HUGE, HUGE, 0.1))
    message.pose.pose.orientation = build.quaternion(w, x, y, z)
    quaternion = decode_odometry(message, PARAMS).quaternion
    yaw, pitch, roll = rotation.from_quat(np.roll(quaternion, -1)).as_euler('ZYX')
    assert (yaw, pitch, roll) == pytest.approx((math.pi / 2 - 0.7, 0.0, 0.0), abs=1e-12)


def test_a_twist_that_was_never_filled_is_no_velocity_of_zero(build):
    message = build.odometry(twist_var=(0,) * 6)
    message.twist.twist.linear = build.vector()
    assert not decode_odometry(message, PARAMS).has_velocity
    message.twist.twist.angular.z = 0.1
    assert decode_odometry(message, PARAMS).velocity.tolist() == [0.0, 0.0, 0.0]
    message.twist.twist.angular.z = 0.0
    message.twist.covariance[0] = 0.01
    assert decode_odometry(message, PARAMS).has_velocity


@pytest.mark.parametrize('axis', [0, 1])
def test_without_a_horizontal_axis_there_is_no_position(build, axis):
    variances = [0.1] * 6
    variances[axis] = HUGE
    sample = decode_odometry(build.odometry(pose_var=variances), PARAMS)
    assert not sample.has_position
    assert sample.has_velocity
    assert np.isfinite(sample.quaternion).all()


def test_unmeasured_fields_may_hold_anything(build):
    message = build.odometry(pose_var=(0.1, 0.1, HUGE, HUGE, HUGE, HUGE), twist_var=(HUGE,) * 6)
    message.pose.pose.position.z = math.nan
    message.pose.pose.orientation = build.quaternion(0.0, 0.0, 0.0, 0.0)
    message.twist.twist.linear.x = math.nan
    sample = decode_odometry(message, PARAMS)
    assert sample.has_position
    assert np.isnan(sample.quaternion).all()
    assert not sample.has_velocity


def spoil(message, path, value):
    *parents, last = path.split('.')
    for name in parents:
        message = getattr(message, name)
    if last.isdigit():
        message[int(last)] = value
    else:
        setattr(message, last, value)


@pytest.mark.parametrize(('path', 'value', 'reason'), [
    ('header.stamp.sec', -1, 'zero_stamp'),
    ('pose.pose.position.x', math.nan, 'not_finite'),
    ('pose.pose.position.z', math.inf, 'not_finite'),
    ('pose.pose.position.y', 1e300, 'out_of_range'),
    ('pose.pose.orientation.x', math.nan, 'not_finite'),
    ('pose.pose.orientation.w', 0.0, 'zero_quaternion'),
    ('pose.pose.orientation.w', 1.2, 'bad_quaternion'),
    ('pose.covariance.0', math.nan, 'nan_covariance'),
    ('pose.covariance.8', math.nan, 'nan_covariance'),
    ('pose.covariance.7', -1.0, 'negative_covariance'),
    ('pose.covariance.1', 1.0, 'indefinite_covariance'),
    ('pose.covariance.1', math.inf, 'indefinite_covariance'),
    ('pose.covariance', [0.1] * 9, 'bad_covariance'),
    ('twist.twist.linear.y', -math.inf, 'not_finite'),
    ('twist.twist.linear.x', 1e5, 'out_of_range'),
    ('twist.covariance.14', -1e-9, 'negative_covariance'),
    ('twist.covariance.35', math.nan, 'nan_covariance'),
])
def test_bad_odometry_is_refused_by_reason(build, path, value, reason):
    message = build.odometry()
    assert decode_odometry(message, PARAMS).has_position
    spoil(message, path, value)
    with pytest.raises(Refused) as refused:
        decode_odometry(message, PARAMS)
    assert refused.value.reason == reason
    assert len(refused.value.detail) > 20


def test_nothing_measured_is_refused(build):
    with pytest.raises(Refused) as refused:
        decode_odometry(build.odometry(pose_var=(HUGE,) * 6, twist_var=(HUGE,) * 6), PARAMS)
    assert refused.value.reason == 'not_measured'


def test_slightly_long_quaternions_are_normalised(build):
    message = build.odometry()
    message.pose.pose.orientation = build.quaternion(1.05, 0.0, 0.0, 0.0)
    assert np.linalg.norm(decode_odometry(message, PARAMS).quaternion) == pytest.approx(1.0)


def test_infinite_and_nan_together_are_nan(build):
    message = build.odometry(pose_var=(0.1, 0.1, math.inf, 0.1, 0.1, 0.1))
    assert math.isnan(decode_odometry(message, PARAMS).position[2])
    message.pose.covariance[35] = math.nan
    with pytest.raises(Refused) as refused:
        decode_odometry(message, PARAMS)
    assert refused.value.reason == 'nan_covariance'


def test_husky_wheels(recorded):
    messages = recorded('rl_husky', '/husky_velocity_controller/odom')
    samples = [decode_odometry(message, PARAMS) for message in messages]
    assert len(samples) == 3952
    assert samples[0].position.tolist() == [-0.30489320435155026, 8.251562792367952, 0.0]
    assert all(sample.velocity[1] == 0.0 for sample in samples)
    # The wheels move along the nose: displacements turned by the decoded attitude agree.
    position = np.array([sample.position for sample in samples])
    yaw = np.array([2 * math.atan2(s.quaternion[3], s.quaternion[0]) for s in samples])
    step = np.diff(position, axis=0)
    along = step[:, 0] * np.cos(yaw[:-1]) + step[:, 1] * np.sin(yaw[:-1])
    across = step[:, 1] * np.cos(yaw[:-1]) - step[:, 0] * np.sin(yaw[:-1])
    assert np.abs(along).sum() > 300.0
    assert np.abs(across).sum() < 0.05 * np.abs(along).sum()
    dt = np.diff([sample.time_us for sample in samples]) * 1e-6
    speed = np.array([sample.velocity[0] for sample in samples])
    assert np.sum(speed[:-1] * dt) == pytest.approx(along.sum(), rel=2e-3)


def test_jackal_leaves_z_and_tilt_unmeasured(recorded):
    for message in recorded('rl_jackal', '/jackal_velocity_controller/odom')[:20]:
        sample = decode_odometry(message, PARAMS)
        assert math.isnan(sample.position[2])
        assert sample.has_position
        assert sample.quaternion[1] == sample.quaternion[2] == 0.0


def test_rover_has_positions_only(recorded):
    samples = [
        decode_odometry(m, PARAMS) for m in recorded('rover_canada_openvins_gps_imu', '/odom')]
    assert all(np.isfinite(sample.position).all() for sample in samples)
    assert all(np.isnan(sample.quaternion).all() for sample in samples)
    assert not any(sample.has_velocity for sample in samples)


def test_novatel_zero_covariances_get_the_defaults(recorded):
    samples = [decode_odometry(m, PARAMS) for m in recorded('novatel_oem7', '/novatel/oem7/odom')]
    assert len(samples) == 12
    assert samples[0].position_var == pytest.approx((0.01,) * 3)
    # ENU variances 2.84434, 3.676855, 12.914931 of the second message.
    assert samples[1].position_var == pytest.approx((3.676855, 2.84434, 12.914931), abs=1e-5)
    # Nose to UTM north.
    assert samples[1].quaternion == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=1e-12)
