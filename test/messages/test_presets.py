"""Odometry as its sources publish it, read with the preset of each."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ekf_fusion_ros.messages.decode_odometry import decode_odometry
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params import load_file

CONFIG = Path(__file__).resolve().parents[2] / 'config'
HALF = math.sqrt(0.5)


def message(child, linear, pose_variance=0.0, twist_variance=0.0,
            orientation=(0.0, 0.0, HALF, HALF)):
    """Odometry that looks along y of its frame."""
    def vector(x, y, z):
        return SimpleNamespace(x=x, y=y, z=z)

    x, y, z, w = orientation
    pose = SimpleNamespace(position=vector(1.0, 2.0, 3.0),
                           orientation=SimpleNamespace(x=x, y=y, z=z, w=w))
    twist = SimpleNamespace(linear=vector(*linear), angular=vector(0.0, 0.0, 0.0))
    return SimpleNamespace(
        header=SimpleNamespace(stamp=SimpleNamespace(sec=10, nanosec=0), frame_id='world'),
        child_frame_id=child,
        pose=SimpleNamespace(pose=pose, covariance=(np.eye(6) * pose_variance).ravel()),
        twist=SimpleNamespace(twist=twist, covariance=(np.eye(6) * twist_variance).ravel()))


def decoded(preset, odometry):
    return decode_odometry(odometry, load_file(CONFIG / f'{preset}.yaml').params.messages)


def test_vins_fusion_tells_velocity_along_its_world():
    sample = decoded('vins_fusion', message('world', (0.0, 2.0, 0.0)))
    np.testing.assert_allclose(sample.velocity, (2.0, 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(sample.position_var, 0.01)


def test_openvins_has_no_covariance_of_the_rate():
    odometry = message('imu', (2.0, 0.0, 0.0), 0.04, 0.01)
    odometry.twist.covariance[[21, 28, 35]] = math.inf
    sample = decoded('openvins', odometry)
    np.testing.assert_allclose(sample.velocity, (2.0, 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(np.diag(sample.velocity_cov), 0.01)


def test_rtabmap_that_is_lost_measures_nothing():
    lost = message('base_link', (0.0, 0.0, 0.0), 9999.0, 9999.0, orientation=(0.0, 0.0, 0.0, 0.0))
    with pytest.raises(Refused):
        decoded('rtabmap', lost)


def test_zed_without_a_twist_is_used_by_its_pose():
    sample = decoded('zed', message('zed_camera_link', (0.0, 0.0, 0.0), 0.01))
    assert np.isnan(sample.velocity).all()
    np.testing.assert_allclose(sample.position_var, 0.01)


def test_wheels_say_nothing_of_sideways_motion_but_that_there_is_little():
    odometry = message('base_link', (1.0, 0.0, 0.0))
    odometry.twist.covariance[[0, 7, 14]] = (0.01, 1e6, 1e6)
    sample = decoded('wheel_odometry', odometry)
    np.testing.assert_allclose(sample.velocity, (1.0, 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(np.diag(sample.velocity_cov)[0:2], (0.01, 0.09))
