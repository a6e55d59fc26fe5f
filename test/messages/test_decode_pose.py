"""A given pose: ENU/FLU to NED/FRD, and which components it gives."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from ekf_fusion_ros.messages.decode_pose import decode_pose
from ekf_fusion_ros.messages.refusal import Refused


def pose(frame='map', position=(1.0, 2.0, 3.0), yaw=0.0, variances=(0.1, 0.2, 0.3, 0.4)):
    covariance = np.zeros(36)
    covariance[[0, 7, 14, 35]] = variances
    x, y, z = position
    return SimpleNamespace(
        header=SimpleNamespace(frame_id=frame, stamp=SimpleNamespace(sec=0, nanosec=0)),
        pose=SimpleNamespace(
            covariance=covariance, pose=SimpleNamespace(
                position=SimpleNamespace(x=x, y=y, z=z), orientation=SimpleNamespace(
                    x=0.0, y=0.0, z=math.sin(0.5 * yaw), w=math.cos(0.5 * yaw)))))


@pytest.mark.parametrize('frame', ['map', ''])
def test_axes_and_variances_are_turned(frame):
    given = decode_pose(pose(frame, yaw=math.radians(30.0)), 'map')
    np.testing.assert_array_equal(given.position, (2.0, 1.0, -3.0))
    np.testing.assert_array_equal(given.position_var, (0.2, 0.1, 0.3))
    # 30 degrees north of east is 60 degrees east of north.
    assert given.yaw == pytest.approx(math.radians(60.0))
    assert given.yaw_var == 0.4


def test_an_orientation_that_is_not_given_may_be_anything():
    message = pose(variances=(0.1, 0.1, 0.0, 0.0))
    message.pose.pose.orientation.w = 0.0
    given = decode_pose(message, 'map')
    assert (given.yaw_var, given.position_var[2]) == (0.0, 0.0)


@pytest.mark.parametrize(('message', 'reason'), [
    (pose('odom'), 'wrong_frame'),
    (pose(position=(math.nan, 0.0, 0.0)), 'not_finite'),
    (pose(position=(1e9, 0.0, 0.0)), 'out_of_range'),
    (pose(yaw=math.nan), 'not_finite'),
    (pose(variances=(0.0, 0.0, 0.0, 0.0)), 'not_given'),
    (pose(variances=(0.5, 0.0, 0.0, 0.0)), 'not_given'),
    (pose(variances=(0.5, -1.0, 0.0, 0.0)), 'negative_covariance'),
    (pose(variances=(0.5, math.nan, 0.0, 0.0)), 'nan_covariance'),
    (pose(variances=(0.5, math.inf, 0.0, 0.0)), 'not_finite'),
])
def test_what_cannot_be_set_is_refused(message, reason):
    with pytest.raises(Refused) as caught:
        decode_pose(message, 'map')
    assert caught.value.reason == reason
