"""Heading from two antennas, in its three kinds of message."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from ekf_fusion_ros.messages.decode_gps_heading import decode_gps_heading
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import GpsHeadingMessageParams
from ekf_fusion_ros.params.messages import MessageParams

PARAMS = MessageParams()


def params(**values):
    return MessageParams(gps_heading=GpsHeadingMessageParams(**values))


def as_pose(message):
    return SimpleNamespace(header=message.header, pose=message.pose.pose)


def as_imu(message):
    covariance = [1e6, 0.0, 0.0, 0.0, 1e6, 0.0, 0.0, 0.0, message.pose.covariance[35]]
    return SimpleNamespace(header=message.header, orientation=message.pose.pose.orientation,
                           orientation_covariance=covariance)


@pytest.mark.parametrize(('compass_deg', 'yaw_enu_deg'), [
    (0.0, 90.0), (90.0, 0.0), (-90.0, 180.0), (170.0, -80.0)])
def test_compass_heading(build, compass_deg, yaw_enu_deg):
    message = build.gps_heading(math.radians(yaw_enu_deg), variance=4e-4)
    for kind in (message, as_imu(message)):
        heading = decode_gps_heading(kind, PARAMS)
        assert math.degrees(heading.yaw) == pytest.approx(compass_deg, abs=1e-9)
        assert heading.accuracy == pytest.approx(0.02)
        assert (heading.offset, heading.time_us) == (0.0, 100_250_000)


def test_without_covariance_the_default_holds(build):
    heading = decode_gps_heading(as_pose(build.gps_heading()), params(default_accuracy=0.07))
    assert heading.accuracy == 0.07
    heading = decode_gps_heading(build.gps_heading(variance=0.0), params(default_accuracy=0.07))
    assert heading.accuracy == 0.07


def test_frame_of_north_east_down(build):
    message = build.gps_heading(0.3)
    message.header.frame_id = 'gps_ned'
    assert decode_gps_heading(message, PARAMS).yaw == pytest.approx(0.3)


def test_axis_through_the_antennas(build):
    """Antennas across the vehicle, the second one left: an axis to the north, nose to the east."""
    message = build.gps_heading(math.pi / 2)
    across = params(heading_of='antennas', antenna_yaw=math.pi / 2)
    heading = decode_gps_heading(message, across)
    assert heading.yaw == pytest.approx(math.pi / 2)
    # What ECL observes is yaw + offset, the direction of the axis.
    assert heading.yaw + heading.offset == pytest.approx(0.0, abs=1e-12)
    whole = decode_gps_heading(message, params(antenna_yaw=math.pi / 2))
    assert whole.yaw == pytest.approx(0.0, abs=1e-12)
    assert whole.offset == -math.pi / 2


def test_roll_does_not_count(build):
    message = build.gps_heading(0.0)
    half = math.radians(15.0)
    message.pose.pose.orientation = build.quaternion(w=math.cos(half), x=math.sin(half))
    assert decode_gps_heading(message, PARAMS).yaw == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(('variance', 'reason'), [
    (-1.0, 'negative_covariance'), (math.nan, 'nan_covariance'), (1e6, 'not_measured')])
def test_bad_variance(build, variance, reason):
    message = build.gps_heading(variance=variance)
    for kind in (message, as_imu(message)):
        with pytest.raises(Refused) as refused:
            decode_gps_heading(kind, PARAMS)
        assert refused.value.reason == reason


@pytest.mark.parametrize(('quaternion', 'reason'), [
    ({'w': 0.0}, 'zero_quaternion'), ({'w': math.nan}, 'not_finite'),
    ({'w': 2.0}, 'bad_quaternion'), ({'w': math.sqrt(0.5), 'y': math.sqrt(0.5)}, 'steep')])
def test_bad_orientation(build, quaternion, reason):
    message = build.gps_heading()
    message.pose.pose.orientation = build.quaternion(**quaternion)
    with pytest.raises(Refused) as refused:
        decode_gps_heading(message, PARAMS)
    assert refused.value.reason == reason


def test_imu_without_orientation(build):
    message = as_imu(build.gps_heading())
    message.orientation_covariance[0] = -1.0
    with pytest.raises(Refused) as refused:
        decode_gps_heading(message, PARAMS)
    assert refused.value.reason == 'no_orientation'
