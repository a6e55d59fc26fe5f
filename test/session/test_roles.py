"""Roles and the aiding they call for."""

from __future__ import annotations

import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.roles import age_limit_us
from ekf_fusion_ros.roles import configure


def test_odometry_and_fix():
    ekf2 = configure(Params(), ('odometry', 'fix')).ekf2
    assert ekf2.gnss.enabled
    assert ekf2.vision.use_velocity and ekf2.vision.rotate
    assert not ekf2.vision.use_position and not ekf2.vision.use_yaw
    assert ekf2.height.reference == 'gnss'
    assert ekf2.mag.type == 'none'
    assert ekf2.imu.inhibit_accel_bias


def test_odometry_alone_is_absolute():
    ekf2 = configure(Params(), ('odometry',)).ekf2
    assert not ekf2.gnss.enabled
    assert ekf2.vision.use_position and ekf2.vision.use_yaw and not ekf2.vision.rotate
    assert ekf2.height.reference == 'vision'


def test_autopilot_sensors_keep_the_defaults():
    ekf2 = configure(Params(), ('imu', 'fix', 'fix_velocity', 'magnetic_field', 'pressure')).ekf2
    assert ekf2.height.reference == 'baro'
    assert ekf2.mag.type == 'auto'
    assert not ekf2.imu.inhibit_accel_bias
    assert not ekf2.vision.use_velocity


def test_declared_north_is_used():
    params = with_overrides(Params(), {'messages.odometry.true_heading': True})
    vision = configure(params, ('odometry', 'fix')).ekf2.vision
    assert vision.use_yaw and not vision.rotate


def test_what_the_user_chose_wins():
    params = with_overrides(
        Params(), {'ekf2.height.reference': 'vision', 'ekf2.mag.type': 'indoor'})
    ekf2 = configure(params, ('odometry', 'fix')).ekf2
    assert ekf2.height.reference == 'vision'
    assert ekf2.mag.type == 'indoor'


def test_automatic_aiding_can_be_switched_off():
    params = with_overrides(Params(), {'session.automatic_aiding': False})
    assert configure(params, ('odometry', 'fix')) == params


def test_horizon_lies_behind_delays_and_hold():
    params = with_overrides(Params(), {'ekf2.gnss.delay_ms': 400})
    ekf2 = configure(params, ('imu', 'fix')).ekf2
    assert ekf2.timing.horizon_min_ms >= 400 + params.session.hold_ms


def test_mounting_of_the_messages_becomes_the_lever_arm():
    params = with_overrides(Params(), {'messages.fix.mount_xyz': '0.5, 0.2, 1.0'})
    assert configure(params, ('imu', 'fix')).ekf2.gnss.position == (0.5, -0.2, -1.0)


@pytest.mark.parametrize(('roles', 'word'), [
    (('fix',), 'no inertial input'),
    (('imu', 'fix_velocity'), 'needs a fix'),
    (('imu', 'gps_heading'), 'needs a fix'),
    (('imu', 'gyroscope'), 'unknown role'),
    (('imu', 'fix_2'), 'role fix_2 needs a fix topic'),
    (('imu', 'fix', 'fix_velocity_2'), 'role fix_velocity_2 needs a fix_2 topic'),
    (('imu', 'fix', 'fix_2', 'fix_velocity_3'), 'role fix_velocity_3 needs a fix_3 topic'),
])
def test_roles_that_cannot_be_fused(roles, word):
    with pytest.raises(ValueError, match=word):
        configure(Params(), roles)


def test_dual_antenna_heading_is_used_where_it_comes():
    assert configure(Params(), ('imu', 'fix', 'gps_heading')).ekf2.gnss.yaw
    assert not configure(Params(), ('imu', 'fix')).ekf2.gnss.yaw


@pytest.mark.parametrize(('roles', 'reference'), [
    (('imu', 'range', 'flow'), 'range'), (('imu', 'flow'), 'vision'),
    (('imu', 'range', 'fix'), 'gnss'), (('imu', 'range', 'odometry'), 'vision'),
    (('imu', 'range', 'pressure'), 'baro')])
def test_height_without_pressure(roles, reference):
    assert configure(Params(), roles).ekf2.height.reference == reference


@pytest.mark.parametrize('role', ['range', 'flow', 'airspeed', 'landed', 'aux_velocity'])
def test_each_further_role_joins_and_changes_nothing_of_the_others(role):
    plain = configure(Params(), ('imu', 'fix', 'pressure')).ekf2
    joined = configure(Params(), ('imu', 'fix', 'pressure', role)).ekf2
    for group in ('gnss', 'vision', 'mag', 'baro', 'height', 'imu', 'timing'):
        assert getattr(joined, group) == getattr(plain, group)


def test_parts_of_a_fix_may_be_as_late_as_pairing_allows():
    params = configure(Params(), {'imu', 'fix', 'fix_velocity', 'gps_heading'})
    assert age_limit_us(params, 'gps_heading') == age_limit_us(params, 'fix_velocity') == 500_000
    # 200 ms of horizon and 100 ms beyond it, less 100 ms of delay and 20 ms of holding
    assert age_limit_us(params, 'airspeed') == 180_000
    assert age_limit_us(params, 'aux_velocity') == age_limit_us(params, 'range') == 275_000


def test_fix_older_than_the_horizon_can_take_is_refused():
    params = configure(Params(), {'odometry', 'fix'})
    # 200 ms of horizon and 100 ms beyond it, less 110 ms of delay and 20 ms of holding
    assert age_limit_us(params, 'fix') == 170_000
    late = configure(with_overrides(Params(), {'session.horizon_ms': 700.0}), {'odometry', 'fix'})
    assert age_limit_us(late, 'fix') == 500_000


def test_the_horizon_lies_behind_the_delay_of_a_second_receiver():
    params = with_overrides(Params(), {'receivers.fix_2.delay_ms': 400.0})
    assert configure(params, ('imu', 'fix')).ekf2.timing.horizon_min_ms == 200.0
    assert configure(params, ('imu', 'fix', 'fix_2')).ekf2.timing.horizon_min_ms == 440.0
