"""NavSatFix and receiver velocity: status, covariance types, and what is refused."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from ekf_fusion_ros.messages.decode_fix import decode_fix
from ekf_fusion_ros.messages.decode_fix import decode_fix_velocity
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import FixMessageParams
from ekf_fusion_ros.params.messages import FixVelocityMessageParams
from ekf_fusion_ros.params.messages import MessageParams

PARAMS = MessageParams(
    fix=FixMessageParams(default_eph=7.0, default_epv=11.0, min_eph=0.02, min_epv=0.03),
    fix_velocity=FixVelocityMessageParams(default_accuracy=0.7, min_accuracy=0.05))


def test_position_and_diagonal_accuracy(build):
    for kind in (1, 2):
        sample = decode_fix(build.fix(kind), PARAMS)
        assert (sample.lat, sample.lon, sample.alt) == (47.4, 8.5, 488.0)
        assert (sample.eph, sample.epv) == (2.0, 3.0)
        assert sample.time_us == 100_250_000
        assert not sample.has_velocity
        assert sample.nsats is None
        assert sample.pdop is None


def test_known_covariance_gives_the_major_axis(build):
    message = build.fix(3)
    # Error ellipse of 3 m by 1 m, turned by 30 deg.
    turn = np.array(((math.cos(0.5236), -math.sin(0.5236)), (math.sin(0.5236), math.cos(0.5236))))
    covariance = message.position_covariance.reshape(3, 3)
    covariance[:2, :2] = turn @ np.diag((9.0, 1.0)) @ turn.T
    assert decode_fix(message, PARAMS).eph == pytest.approx(3.0, abs=1e-12)
    message.position_covariance_type = 2
    assert decode_fix(message, PARAMS).eph == pytest.approx(math.sqrt(7.0), abs=1e-5)


@pytest.mark.parametrize('garbage', [0.0, math.nan, -1.0, 1e-6])
def test_unknown_covariance_is_never_read(build, garbage):
    sample = decode_fix(build.fix(0, (garbage,) * 3), PARAMS)
    assert (sample.eph, sample.epv) == (7.0, 11.0)


def test_zero_variance_is_unknown_axis_by_axis(build):
    sample = decode_fix(build.fix(2, (0.0, 0.0, 4.0)), PARAMS)
    assert (sample.eph, sample.epv) == (7.0, 2.0)
    sample = decode_fix(build.fix(3, (4.0, 1.0, 0.0)), PARAMS)
    assert (sample.eph, sample.epv) == (2.0, 11.0)


def test_floors(build):
    sample = decode_fix(build.fix(2, (1e-8, 1e-8, 1e-8)), PARAMS)
    assert (sample.eph, sample.epv) == (0.02, 0.03)


@pytest.mark.parametrize(('status', 'fix_type'), [(0, 3), (1, 4), (2, 6)])
def test_status_is_px4s_fix_type(build, status, fix_type):
    message = build.fix()
    message.status.status = status
    assert decode_fix(message, PARAMS).fix_type == fix_type


def test_altitude_may_be_missing(build):
    message = build.fix()
    message.altitude = math.nan
    sample = decode_fix(message, PARAMS)
    assert math.isnan(sample.alt)
    assert sample.lat == 47.4


@pytest.mark.parametrize(('field', 'value', 'reason'), [
    ('status', SimpleNamespace(status=-1, service=1), 'no_fix'),
    ('status', SimpleNamespace(status=-2, service=1), 'unknown_status'),
    ('latitude', math.nan, 'not_finite'),
    ('longitude', math.inf, 'not_finite'),
    ('latitude', -2e7, 'bad_latitude'),
    ('latitude', 90.001, 'bad_latitude'),
    ('longitude', 180.5, 'bad_longitude'),
    ('altitude', math.inf, 'bad_altitude'),
    ('position_covariance_type', 4, 'bad_covariance'),
])
def test_bad_fix_is_refused_by_reason(build, field, value, reason):
    message = build.fix()
    setattr(message, field, value)
    with pytest.raises(Refused) as refused:
        decode_fix(message, PARAMS)
    assert refused.value.reason == reason


@pytest.mark.parametrize(('kind', 'index', 'value', 'reason'), [
    (1, 0, math.nan, 'nan_covariance'), (2, 4, -1.0, 'negative_covariance'),
    (3, 8, math.inf, 'not_finite'), (3, 1, math.nan, 'nan_covariance'),
    (3, 3, 9.0, 'indefinite_covariance'),
])
def test_bad_covariance_is_refused_by_reason(build, kind, index, value, reason):
    message = build.fix(kind)
    message.position_covariance[index] = value
    with pytest.raises(Refused) as refused:
        decode_fix(message, PARAMS)
    assert refused.value.reason == reason


def test_velocity_is_enu_unless_named_ned(build):
    time_us, velocity, accuracy = decode_fix_velocity(build.fix_velocity(), PARAMS)
    assert time_us == 100_250_000
    assert velocity.tolist() == [2.0, 1.0, -3.0]
    assert accuracy == 0.5
    ned = decode_fix_velocity(build.fix_velocity(frame_id='gps_ned'), PARAMS)
    assert ned.velocity.tolist() == [1.0, 2.0, 3.0]


def test_velocity_accuracy_fallback_and_floor(build):
    assert decode_fix_velocity(build.fix_velocity((0, 0, 0)), PARAMS).accuracy == 0.7
    assert decode_fix_velocity(build.fix_velocity((1e-9,) * 3), PARAMS).accuracy == 0.05
    plain = build.fix_velocity()
    plain.twist = plain.twist.twist
    assert decode_fix_velocity(plain, PARAMS).accuracy == 0.7
    assert decode_fix_velocity(plain, PARAMS).velocity.tolist() == [2.0, 1.0, -3.0]


@pytest.mark.parametrize(('variances', 'reason'), [
    ((math.nan, 1, 1), 'nan_covariance'), ((1, 1, -1), 'negative_covariance'),
    ((1e6, 1, 1), 'not_measured'), ((1, 1, math.inf), 'not_measured'),
])
def test_bad_velocity_covariance(build, variances, reason):
    with pytest.raises(Refused) as refused:
        decode_fix_velocity(build.fix_velocity(variances), PARAMS)
    assert refused.value.reason == reason


@pytest.mark.parametrize(('value', 'reason'), [(math.nan, 'not_finite'), (2e3, 'out_of_range')])
def test_bad_velocity(build, value, reason):
    message = build.fix_velocity()
    message.twist.twist.linear.y = value
    with pytest.raises(Refused) as refused:
        decode_fix_velocity(message, PARAMS)
    assert refused.value.reason == reason


def test_husky_fixes(recorded):
    samples = [decode_fix(message, PARAMS) for message in recorded('rl_husky', '/fix')]
    assert len(samples) == 989
    assert {sample.fix_type for sample in samples} == {4}
    # ORIGIN.txt: variances 0.64 to 2.89 horizontally, 2.56 to 11.56 vertically.
    assert min(sample.eph for sample in samples) == pytest.approx(0.8)
    assert max(sample.eph for sample in samples) == pytest.approx(1.7)
    assert max(sample.epv for sample in samples) == pytest.approx(3.4)


def test_novatel_first_fix_is_unknown_the_second_diagonal(recorded):
    first, second = [decode_fix(m, PARAMS) for m in recorded('novatel_oem7', '/gps/fix')[:2]]
    assert (first.eph, first.epv) == (7.0, 11.0)
    assert second.eph == pytest.approx(math.sqrt(3.676855), abs=1e-6)


def test_sitl_fixes_without_fix_are_counted(recorded):
    reasons = []
    for message in recorded('px4_sitl_events', '/fix'):
        try:
            decode_fix(message, PARAMS)
        except Refused as refused:
            reasons.append(refused.reason)
    assert reasons == ['no_fix'] * 160


def test_the_origin_of_latitude_and_longitude_is_no_fix(build):
    message = build.fix(2)
    message.latitude = message.longitude = 0.0
    with pytest.raises(Refused) as refused:
        decode_fix(message, PARAMS)
    assert refused.value.reason == 'zero_position'
    message.longitude = 6.7
    assert decode_fix(message, PARAMS).lon == 6.7
