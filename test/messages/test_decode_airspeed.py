"""Airspeed as a twist, and the true airspeed that density makes of it."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from ekf_fusion_ros.completion import Completion
from ekf_fusion_ros.messages.decode_airspeed import decode_airspeed
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import AirspeedMessageParams
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import GnssSample

PARAMS = MessageParams()
SEA_LEVEL_DENSITY = 1.2250
# ISO 2533: density by altitude.
DENSITY = {1000.0: 1.11166, 5000.0: 0.736116}


def test_linear_x_with_and_without_covariance(build):
    message = build.airspeed(20.0)
    assert decode_airspeed(message, PARAMS) == (100_250_000, 20.0)
    plain = SimpleNamespace(header=message.header, twist=message.twist.twist)
    assert decode_airspeed(plain, PARAMS) == (100_250_000, 20.0)


def test_noise_below_zero_is_zero(build):
    assert decode_airspeed(build.airspeed(-0.7), PARAMS).speed == 0.0


@pytest.mark.parametrize(('speed', 'reason'), [
    (math.nan, 'not_finite'), (math.inf, 'not_finite'), (401.0, 'out_of_range'),
    (-500.0, 'out_of_range')])
def test_bad_speed(build, speed, reason):
    with pytest.raises(Refused) as refused:
        decode_airspeed(build.airspeed(speed), PARAMS)
    assert refused.value.reason == reason


@pytest.mark.parametrize(('variance', 'reason'), [
    (-1.0, 'negative_covariance'), (math.nan, 'nan_covariance'), (1e6, 'not_measured')])
def test_bad_variance(build, variance, reason):
    message = build.airspeed()
    message.twist.covariance[0] = variance
    with pytest.raises(Refused) as refused:
        decode_airspeed(message, PARAMS)
    assert refused.value.reason == reason


@pytest.mark.parametrize('altitude', DENSITY)
def test_density_at_the_pressure_altitude(build, altitude):
    completion = Completion(PARAMS)
    completion.note_fix(GnssSample(1, 47.0, 8.0, 300.0, 1.0, 1.0))
    completion.sample(BaroSample(2, altitude))
    sample = completion.sample(decode_airspeed(build.airspeed(20.0), PARAMS))
    factor = math.sqrt(SEA_LEVEL_DENSITY / DENSITY[altitude])
    assert sample.eas2tas == pytest.approx(factor, rel=1e-5)
    assert sample.true_airspeed == pytest.approx(20.0 * factor, rel=1e-5)


def test_density_at_the_fix_where_there_is_no_pressure(build):
    completion = Completion(PARAMS)
    reading = decode_airspeed(build.airspeed(20.0), PARAMS)
    assert completion.sample(reading).true_airspeed == 20.0
    completion.note_fix(GnssSample(1, 47.0, 8.0, math.nan, 1.0, 1.0))
    completion.note_fix(GnssSample(1, 47.0, 8.0, 1000.0, 1.0, 1.0))
    completion.note_fix(GnssSample(1, 47.0, 8.0, math.nan, 1.0, 1.0))
    factor = math.sqrt(SEA_LEVEL_DENSITY / DENSITY[1000.0])
    assert completion.sample(reading).true_airspeed == pytest.approx(20.0 * factor, rel=1e-5)


def test_true_airspeed_stays_and_warm_air_is_thinner(build):
    params = MessageParams(airspeed=AirspeedMessageParams(kind='true', temperature_offset=28.815))
    sample = Completion(params).sample(decode_airspeed(build.airspeed(20.0), params))
    assert sample.true_airspeed == 20.0
    # 10 % more temperature at the same pressure: 10 % less density.
    assert sample.eas2tas == pytest.approx(math.sqrt(1.1))


def test_recorded_airspeed(recorded):
    speeds = [decode_airspeed(m, PARAMS).speed
              for m in recorded('inav_fixedwing_search_150s', '/airspeed')]
    assert len(speeds) == 9957
    assert 0.0 <= min(speeds) < max(speeds) < 40.0
