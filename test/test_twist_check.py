"""Odometry whose twist is along its own frame is told from one whose twist is in the body."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.frames import swap_attitude
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params.tree import with_overrides
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import NAN4
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.samples import VisionSample
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.twist_check import TwistCheck

RATE, SPEED = 20.0, 0.4


def odometry(turn_rate, axes, seconds=200.0, noise=0.01):
    """Yield messages of a rover on a circle about the origin, in the words of ROS.

    axes: 'body', or 'enu' for a twist along the frame of the positions, taken as FLU.
    """
    rng = np.random.default_rng(5)
    for k in range(round(seconds * RATE)):
        yaw = turn_rate * k / RATE
        radius = SPEED / turn_rate
        east, north = radius * math.sin(yaw), -radius * math.cos(yaw)
        east, north = np.array((east, north)) + rng.normal(0.0, noise, 2)
        forward, left = SPEED, 0.0
        if axes == 'enu':
            forward, left = SPEED * math.cos(yaw), SPEED * math.sin(yaw)
        half = 0.5 * yaw
        yield VisionSample(
            1_000_000 + round(1e6 * k / RATE), np.array((north, east, 0.0)),
            swap_attitude(np.array((math.cos(half), 0.0, 0.0, math.sin(half)))),
            np.array((forward, -left, 0.0)), np.full(3, 0.01), 0.01 * np.eye(3), 0.01,
            VelocityFrame.BODY_FRD)


@pytest.mark.parametrize(('axes', 'turn_rate', 'told'), [
    ('body', 0.1, False), ('enu', 0.1, True), ('enu', -0.1, True),
    ('body', 1e-4, False), ('enu', 1e-4, False)])
def test_a_twist_along_the_frame_of_the_positions_is_told_once_it_shows(axes, turn_rate, told):
    check = TwistCheck()
    says = [sample.time_us for sample in odometry(turn_rate, axes)
            if check.open and check.note(sample, jumped=False)]
    assert len(says) == int(told)
    assert ('messages.odometry.twist_frame' in check.sentence) == told


@pytest.mark.parametrize(('lost', 'words'), [
    ({}, ''),
    ({'quaternion': NAN4}, 'the odometry has no orientation'),
    ({'quaternion': NAN4, 'position': NAN3}, 'neither position nor orientation')])
def test_what_odometry_alone_does_not_tell_is_said(lost, words):
    session = FusionSession(Params(), ['odometry'])
    for sample in odometry(0.1, 'body', seconds=5.0):
        session.push(sample._replace(**lost))
    assert (words in ' '.join(session.warnings())) if words else not session.warnings()


def test_the_session_warns():
    session = FusionSession(Params(), ['odometry'])
    for sample in odometry(0.1, 'enu', seconds=100.0):
        session.push(sample)
    assert 'messages.odometry.twist_frame' in session.health().text
    assert [event for event in session.drain_events() if 'twist_frame' in event.text]


@pytest.mark.parametrize('turn_rate', [0.1, -0.1])
def test_a_preset_for_the_wrong_source_is_told_the_other_way(turn_rate):
    """A twist in the body that is taken for one along the frame of the positions."""
    params = with_overrides(Params(), {'messages.odometry.twist_frame': 'parent'})
    session = FusionSession(params, ['odometry'])
    for sample in odometry(turn_rate, 'body', seconds=100.0):
        forward, right, down = sample.velocity
        as_if_enu = np.array((-right, forward, down))
        session.push(sample._replace(
            velocity=matrix_from_quat(sample.quaternion).T @ as_if_enu))
    assert 'set messages.odometry.twist_frame to child' in session.health().text
