"""MagneticField and FluidPressure."""

from __future__ import annotations

import math

import pytest

from ekf_fusion_ros.messages.decode_magnetic_field import decode_magnetic_field
from ekf_fusion_ros.messages.decode_pressure import decode_pressure
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import MagneticFieldMessageParams
from ekf_fusion_ros.params.messages import MessageParams

PARAMS = MessageParams()


def test_tesla_flu_becomes_gauss_frd(build):
    sample = decode_magnetic_field(build.magnetic_field(), PARAMS)
    assert sample.time_us == 100_250_000
    assert sample.field == pytest.approx((0.2, 0.1, 0.4), abs=1e-15)


def test_mounting(build):
    # A sensor turned by 90 deg to the left: its x is the body's left.
    params = MessageParams(
        magnetic_field=MagneticFieldMessageParams(mount_rpy=(0.0, 0.0, math.pi / 2)))
    sample = decode_magnetic_field(build.magnetic_field(), params)
    assert sample.field == pytest.approx((0.1, -0.2, 0.4), abs=1e-15)


@pytest.mark.parametrize(('x', 'reason'), [
    (math.nan, 'not_finite'), (0.2, 'out_of_range'), (math.inf, 'not_finite')])
def test_bad_field(build, x, reason):
    message = build.magnetic_field()
    message.magnetic_field.x = x
    with pytest.raises(Refused, match='tesla') as refused:
        decode_magnetic_field(message, PARAMS)
    assert refused.value.reason == reason


def test_a_field_of_zero_is_no_measurement(build):
    message = build.magnetic_field()
    message.magnetic_field = build.vector()
    with pytest.raises(Refused) as refused:
        decode_magnetic_field(message, PARAMS)
    assert refused.value.reason == 'zero_field'


def test_pressure_is_altitude_of_the_standard_atmosphere(build):
    message = build.pressure()
    assert decode_pressure(message, PARAMS).altitude == 0.0
    message.fluid_pressure = 89874.6
    assert decode_pressure(message, PARAMS).altitude == pytest.approx(1000.0, abs=0.01)


@pytest.mark.parametrize(('pressure', 'reason'), [
    (1013.25e-1, 'out_of_range'), (0.0, 'out_of_range'), (math.nan, 'not_finite'),
    (1e7, 'out_of_range')])
def test_bad_pressure(build, pressure, reason):
    message = build.pressure()
    message.fluid_pressure = pressure
    with pytest.raises(Refused) as refused:
        decode_pressure(message, PARAMS)
    assert refused.value.reason == reason


def test_sitl_barometer_follows_the_fix(recorded):
    messages = recorded('px4_sitl_v19_position', '/pressure')
    altitude = [decode_pressure(message, PARAMS).altitude for message in messages]
    heights = [m.altitude for m in recorded('px4_sitl_v19_position', '/fix')]
    assert max(altitude) - min(altitude) == pytest.approx(max(heights) - min(heights), abs=2.0)


def test_sitl_field_is_the_earths(recorded):
    # The simulator's site: table strength 0.48 G, dip 63 deg.
    for message in recorded('px4_sitl_v19_position', '/mag')[:50]:
        sample = decode_magnetic_field(message, PARAMS)
        assert 0.4 < math.hypot(*sample.field) < 0.6
