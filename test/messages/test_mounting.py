"""Lever arms and rotations of sensor mounts."""

from __future__ import annotations

from dataclasses import replace
import math

import pytest

from ekf_fusion_ros.messages.mounting import sensor_to_body
from ekf_fusion_ros.messages.mounting import with_mounting
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.messages import FixMessageParams
from ekf_fusion_ros.params.messages import ImuMessageParams
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.params.messages import OdometryMessageParams


def test_lever_arms_become_frd():
    params = with_mounting(Ekf2Params(), MessageParams(
        imu=ImuMessageParams(mount_xyz=(0.1, 0.2, 0.3)),
        fix=FixMessageParams(mount_xyz=(-0.5, 0.0, 1.0)),
        odometry=OdometryMessageParams(mount_xyz=(0.4, -0.1, -0.2))))
    assert params.imu.position == (0.1, -0.2, -0.3)
    assert params.gnss.position == (-0.5, 0.0, -1.0)
    assert params.vision.position == (0.4, 0.1, 0.2)


def test_no_mounting_leaves_the_estimators_values():
    chosen = replace(Ekf2Params(), gnss=GnssParams(position=(1.0, 2.0, 3.0)))
    assert with_mounting(chosen, MessageParams()).gnss.position == (1.0, 2.0, 3.0)


def test_two_different_lever_arms_are_named():
    chosen = replace(Ekf2Params(), gnss=GnssParams(position=(1.0, 2.0, 3.0)))
    same = MessageParams(fix=FixMessageParams(mount_xyz=(1.0, -2.0, -3.0)))
    assert with_mounting(chosen, same).gnss.position == (1.0, 2.0, 3.0)
    other = MessageParams(fix=FixMessageParams(mount_xyz=(1.0, 0.0, 0.0)))
    with pytest.raises(ValueError, match=r'ekf2\.gnss\.position'):
        with_mounting(chosen, other)


@pytest.mark.parametrize(('rpy', 'sensor', 'body_frd'), [
    ((0.0, 0.0, 0.0), (1.0, 2.0, 3.0), (1.0, -2.0, -3.0)),
    # Yawed left: the sensor's forward is the body's left.
    ((0.0, 0.0, math.pi / 2), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0)),
    # Rolled upside down.
    ((math.pi, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)),
    # Pitched by 90 deg about the left axis: forward looks down.
    ((0.0, math.pi / 2, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
])
def test_rotations_by_hand(rpy, sensor, body_frd):
    assert sensor_to_body(rpy, 'sensor') @ sensor == pytest.approx(body_frd, abs=1e-15)


def test_an_frd_sensor_on_a_turned_mount():
    # Forward-right-down sensor, mount yawed left: its right is the body's forward.
    rotation = sensor_to_body((0.0, 0.0, math.pi / 2), 'imu_frd')
    assert rotation @ (0.0, 1.0, 0.0) == pytest.approx((1.0, 0.0, 0.0), abs=1e-15)
