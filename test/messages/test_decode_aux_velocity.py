"""Velocity against a target at rest, from a twist in ENU."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from ekf_fusion_ros.messages.decode_aux_velocity import decode_aux_velocity
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import AuxVelocityMessageParams
from ekf_fusion_ros.params.messages import MessageParams

PARAMS = MessageParams()


def test_east_north_up_becomes_north_east_down_with_its_variances(build):
    sample = decode_aux_velocity(build.aux_velocity(), PARAMS)
    assert sample.time_us == 100_250_000
    np.testing.assert_array_equal(sample.velocity, (2.0, 3.0, 0.5))
    np.testing.assert_array_equal(sample.variance, (0.04, 0.01, 0.09))


def test_a_frame_of_north_east_down_is_taken_as_it_is(build):
    sample = decode_aux_velocity(build.aux_velocity(frame_id='target_ned'), PARAMS)
    np.testing.assert_array_equal(sample.velocity, (3.0, 2.0, -0.5))
    np.testing.assert_array_equal(sample.variance, (0.01, 0.04, 0.09))


def test_without_a_covariance_the_noise_is_that_of_the_parameter(build):
    params = MessageParams(aux_velocity=AuxVelocityMessageParams(default_noise=0.3))
    message = build.aux_velocity()
    plain = SimpleNamespace(header=message.header, twist=message.twist.twist)
    assert decode_aux_velocity(plain, params).variance == pytest.approx(3 * [0.09])
    message.twist.covariance[:] = 0.0
    assert decode_aux_velocity(message, params).variance == pytest.approx(3 * [0.09])


def test_too_good_a_noise_is_not_believed(build):
    message = build.aux_velocity()
    message.twist.covariance[[0, 7, 14]] = 1e-12
    assert decode_aux_velocity(message, PARAMS).variance == pytest.approx(3 * [1e-4])


def test_the_vertical_axis_may_be_unmeasured(build):
    message = build.aux_velocity(up=math.nan)
    message.twist.covariance[14] = 1e6
    sample = decode_aux_velocity(message, PARAMS)
    assert sample.velocity[2] == 0.0 and sample.variance[2] == 9e4


@pytest.mark.parametrize(('place', 'variance', 'reason'), [
    (0, 1e6, 'not_measured'), (7, math.inf, 'not_measured'), (7, -1.0, 'negative_covariance'),
    (14, math.nan, 'nan_covariance')])
def test_bad_variances_are_refused(build, place, variance, reason):
    message = build.aux_velocity()
    message.twist.covariance[place] = variance
    with pytest.raises(Refused) as refused:
        decode_aux_velocity(message, PARAMS)
    assert refused.value.reason == reason


@pytest.mark.parametrize(('east', 'reason'), [(math.nan, 'not_finite'), (2e3, 'out_of_range')])
def test_bad_velocities_are_refused(build, east, reason):
    with pytest.raises(Refused) as refused:
        decode_aux_velocity(build.aux_velocity(east=east), PARAMS)
    assert refused.value.reason == reason
