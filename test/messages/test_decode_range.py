"""Range, by REP-117."""

from __future__ import annotations

import math

import pytest

from ekf_fusion_ros.messages.decode_range import decode_range
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.params.messages import RangeMessageParams

PARAMS = MessageParams()


def test_distance_and_limits_are_those_of_the_message(build):
    sample = decode_range(build.range(4.0), PARAMS)
    assert sample.time_us == 100_250_000
    assert (sample.distance, sample.quality) == (4.0, -1)
    assert (sample.min_distance, sample.max_distance) == (0.2, 20.0)


@pytest.mark.parametrize(('distance', 'limit'), [(-math.inf, 0.2), (math.inf, 20.0)])
def test_nothing_within_reach_is_a_sample_without_quality(build, distance, limit):
    sample = decode_range(build.range(distance), PARAMS)
    assert (sample.distance, sample.quality) == (limit, 0)


@pytest.mark.parametrize('distance', [0.0, 0.1, 25.0])
def test_finite_distances_beyond_the_limits_are_for_the_estimator(build, distance):
    assert decode_range(build.range(distance), PARAMS).distance == distance


@pytest.mark.parametrize(('field', 'value', 'reason'), [
    ('range', math.nan, 'not_finite'), ('range', -1.0, 'negative_range'),
    ('max_range', 0.0, 'bad_limits'), ('max_range', math.inf, 'bad_limits'),
    ('min_range', math.nan, 'bad_limits'), ('min_range', -1.0, 'bad_limits'),
    ('min_range', 20.0, 'bad_limits'), ('variance', -1.0, 'negative_covariance'),
    ('variance', math.nan, 'nan_covariance')])
def test_bad_range(build, field, value, reason):
    message = build.range()
    setattr(message, field, value)
    with pytest.raises(Refused) as refused:
        decode_range(message, PARAMS)
    assert refused.value.reason == reason


@pytest.mark.parametrize(('radiation_type', 'ultrasound'), [(0, True), (1, False)])
def test_sonar_is_told_from_lidar_and_the_variance_passed_on(build, radiation_type, ultrasound):
    message = build.range()
    message.radiation_type, message.variance = radiation_type, 0.04
    sample = decode_range(message, PARAMS)
    assert (sample.ultrasound, sample.variance) == (ultrasound, pytest.approx(0.04))


def test_message_of_humble_has_no_variance(build):
    message = build.range()
    del message.variance
    assert decode_range(message, PARAMS).distance == 4.0


def test_limits_of_a_driver_that_leaves_them_out(build):
    message = build.range()
    message.min_range = message.max_range = 0.0
    params = MessageParams(range=RangeMessageParams(min_range=0.3, max_range=12.0))
    sample = decode_range(message, params)
    assert (sample.min_distance, sample.max_distance) == (0.3, 12.0)


def test_recorded_lidar(recorded):
    """The flight stays below 5 m with a lidar of 40 m: every reading decodes."""
    samples = [decode_range(m, PARAMS) for m in recorded('inav_quad_optflow', '/range')]
    assert len(samples) == 48636
    assert {round(s.max_distance) for s in samples} == {40}
    assert 3.0 < max(s.distance for s in samples) < 5.0
