"""The bank by itself: offsets, votes of three receivers, late fixes, antennas, accuracies."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.params.receivers import ReceiversParams
from ekf_fusion_ros.receivers.bank import Receiver
from ekf_fusion_ros.receivers.bank import ReceiverBank
from ekf_fusion_ros.receivers.offsets import Offsets
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import GnssSample

SECOND = 1_000_000
START = 100 * SECOND
ORIGIN = GeoPoint(47.0, 8.0, 500.0)
METRE = 1.0 / 111_172.0
"""Degrees of latitude for a metre north at 47 deg, from the meridional radius of WGS84."""


def bank_of(names, state=lambda: None, antennas=None, **params):
    antennas = antennas or {}
    receivers = {name: Receiver(np.array(antennas.get(name, (0.0, 0.0, 0.0))), 110_000)
                 for name in names}
    return ReceiverBank(receivers, ReceiversParams(**params), 'wgs84', 150_000, state)


def fix_at(seconds, north=0.0, up=0.0, **changes):
    fix = GnssSample(START + round(1e6 * seconds), 47.0 + north * METRE, 8.0, 500.0 + up, 1.0, 2.0)
    return fix._replace(**changes)


def north_of(fix):
    return (fix.lat - 47.0) / METRE


def standing(yaw=0.0, rate=0.0, time_us=START):
    """Return an estimate that stands at the origin."""
    return NavState(
        time_us, np.array([math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]), np.zeros(3),
        np.zeros(3), np.array([0.0, 0.0, rate]), 0.01 * np.eye(6), 0.01 * np.eye(3), np.zeros(3),
        np.zeros(3), ORIGIN, True, dead_reckoning=False, local_position_valid=True,
        global_position_valid=True)


def push(bank, seconds, **norths):
    """Push one fix of each receiver and return what comes out."""
    return [blended for name, north in norths.items()
            for blended in bank.push(name, fix_at(seconds, north))]


def test_each_kind_has_weights_of_its_own():
    bank = bank_of(('a', 'b'))
    bank.push('a', fix_at(1.0, 0.0, 0.0, velocity=np.array((1.0, 0.0, 0.0)), sacc=0.1))
    fix, = bank.push('b', fix_at(1.0, 1.0, 5.0, eph=2.0, epv=1.0, sacc=0.2,
                                 velocity=np.array((2.0, 0.0, 0.0))))
    # Inverse variances 1 to 1/4, 1/4 to 1, 100 to 25.
    assert north_of(fix) == pytest.approx(0.2, abs=1e-3)
    assert fix.alt == pytest.approx(504.0, abs=1e-3)
    assert fix.velocity[0] == pytest.approx(1.2, abs=1e-6)
    assert (fix.eph, fix.epv, fix.sacc) == (1.0, 1.0, 0.1)


def test_the_antenna_follows_the_weights():
    antennas = {'a': (1.0, 0.0, 0.0), 'b': (-1.0, 0.5, 0.0)}
    yaw, rate = 0.7, 0.5
    bank = bank_of(('a', 'b'), lambda: standing(yaw, rate), antennas)
    ahead = np.array((math.cos(yaw), math.sin(yaw)))
    right = np.array((-math.sin(yaw), math.cos(yaw)))
    for name, (forward, side, _) in antennas.items():
        north, east = forward * ahead + side * right
        swing = rate * np.array((-east, north, 0.0))
        lat, lon = make_projection('wgs84', 47.0, 8.0, 500.0).reproject(north, east)
        out = bank.push(name, fix_at(1.0, lat=lat, lon=lon, velocity=swing, sacc=0.1,
                                     eph={'a': 1.0, 'b': 0.5}[name]))
    fix, = out
    np.testing.assert_allclose(fix.antenna.position, (-0.6, 0.4, 0.0))
    np.testing.assert_allclose(fix.antenna.velocity, (0.0, 0.25, 0.0))
    assert north_of(fix) == pytest.approx((-0.6 * ahead + 0.4 * right)[0], abs=2e-3)
    # Nothing is left of the arms: the receivers agree.
    assert np.abs([status.offset for status in bank.statuses()]).max() < 1e-6


@pytest.mark.parametrize('lie', [20.0, -20.0, 1e4])
def test_two_honest_of_three_outvote_the_third_without_any_prediction(lie):
    bank = bank_of(('a', 'b', 'c'))
    fix, = push(bank, 1.0, a=0.0, b=lie, c=1.0)
    assert north_of(fix) == pytest.approx(0.5, abs=0.01)
    assert 'majority' in bank.statuses()[1].obstacles['position']


def test_all_alike_far_from_the_prediction_are_believed():
    bank = bank_of(('a', 'b'), standing)
    fix, = push(bank, 1.0, a=50.0, b=51.0)
    assert north_of(fix) == pytest.approx(50.5, abs=0.01)


def test_a_reset_of_the_estimate_between_two_fixes_excludes_nobody():
    """The estimate was 30 m off when the first came and is right for the second."""
    place = [np.array((-30.0, 0.0, 0.0))]
    bank = bank_of(('a', 'b'), lambda: standing()._replace(position=place[0]), wait_ms=50.0)
    bank.push('a', fix_at(1.0))
    bank.advance(START + round(1.06e6))
    place[0] = np.zeros(3)
    bank.push('b', fix_at(1.1))
    fix, = bank.advance(START + round(1.16e6))
    assert north_of(fix) == pytest.approx(0.0, abs=1e-6)
    assert not any('position' in status.obstacles for status in bank.statuses())


@pytest.mark.parametrize(('deviation', 'excluded'), [(6.6, False), (6.7, True)])
def test_the_gate(deviation, excluded):
    """Six sigmas of the difference from a mean of 1, 1 and 0.1 m: 6.64 m."""
    bank = bank_of(('a', 'b'), standing, gate=6.0, min_deviation=5.0)
    push(bank, 1.0, a=0.0, b=deviation)
    assert ('position' in bank.statuses()[1].obstacles) == excluded


def test_a_poor_receiver_is_left_out_while_another_is_better():
    bank = bank_of(('a', 'b'), timeout=1.0)
    bank.push('a', fix_at(1.0, 4.0, eph=11.0))
    fix, = bank.push('b', fix_at(1.0, 0.0))
    assert north_of(fix) == pytest.approx(0.0, abs=1e-6)
    assert bank.statuses()[0].obstacles == {
        'position': 'accuracy 11, receivers.max_eph 10', 'velocity': 'not measured'}
    bank.advance(START + 3 * SECOND)
    bank.push('a', fix_at(3.1, 4.0, eph=11.0))
    fix, = bank.advance(START + round(3.3 * SECOND))
    assert north_of(fix) == pytest.approx(4.0, abs=1e-3)


def test_a_receiver_without_3d_fix_does_not_count():
    bank = bank_of(('a', 'b'))
    bank.push('a', fix_at(1.0, 4.0, fix_type=2))
    fix, = bank.push('b', fix_at(1.0, 0.0))
    assert north_of(fix) == pytest.approx(0.0, abs=1e-6)
    assert fix.fix_type == 3


def test_nobody_measures_velocity():
    fix, = push(bank_of(('a', 'b')), 1.0, a=0.0, b=0.0)
    assert np.isnan(fix.velocity).all() and math.isnan(fix.sacc)
    assert fix.velocity is NAN3


def test_every_fix_counts_once_and_stamps_rise():
    """Fixes of three rates and of any lateness within the wait."""
    rng = np.random.default_rng(1)
    rows = sorted((k / rate + phase + rng.uniform(0.0, 0.05), name, k / rate + phase)
                  for name, rate, phase in (('a', 10, 0.0), ('b', 5, 0.03), ('c', 1, 0.5))
                  for k in range(round(10 * rate)))
    bank, out = bank_of(('a', 'b', 'c')), []
    for arrival, name, stamp in rows:
        out += bank.advance(START + round(1e6 * arrival))
        out += bank.push(name, fix_at(stamp))
    out += bank.flush()
    stamps = [fix.time_us for fix in out]
    assert stamps == sorted(set(stamps))
    assert min(np.diff(stamps)) >= 40_000
    assert len(out) >= 100
    assert all(sum(counts.values()) <= 2 for counts in bank.passed_over.values())


def test_offsets_hold_the_level_where_one_goes_and_give_way_slowly():
    """Biases of 2 m and 0 m; the level is their mean, then decays to that of the one left."""
    offsets = Offsets(1, offset_time=10.0, handover_time=60.0)
    both, two, zero = {'a': 1.0, 'b': 1.0}, np.array((2.0,)), np.array((0.0,))
    for k in range(500):
        offsets.update({'a': two, 'b': zero}, both, START + 200_000 * k)
    assert (offsets.of('a')[0], offsets.of('b')[0]) == pytest.approx((1.0, -1.0), abs=0.02)
    for k in range(500, 800):
        offsets.update({'b': zero}, {'b': 1.0}, START + 200_000 * k)
        expected = -math.exp(-(k - 499) * 0.2 / 60.0)
        assert offsets.of('b')[0] == pytest.approx(expected, abs=0.02)
    # The one that is gone is taken along: it would come back without a step.
    assert offsets.of('a')[0] - offsets.of('b')[0] == pytest.approx(2.0, abs=1e-9)


def test_one_that_comes_back_regains_its_weight_in_an_offset_time():
    bank = bank_of(('a', 'b'), standing, offset_time=10.0, timeout=2.0)
    weights = {}
    for k in range(500):
        seconds = 0.2 * k
        bank.advance(START + round(1e6 * (seconds - 0.01)))
        away = 40.0 <= seconds < 60.0
        push(bank, seconds, **({'b': 0.0} if away else {'a': 0.0, 'b': 0.0}))
        weights[k] = bank.statuses()[0].weights[0]
    assert weights[199] == pytest.approx(0.5)
    assert weights[299] == 0.0
    # A tenth against the whole of the other at first, half against whole after half the time.
    assert weights[300] == pytest.approx(0.1 / 1.1, abs=0.01)
    assert weights[325] == pytest.approx(1.0 / 3.0, abs=0.02)
    assert weights[351] == pytest.approx(0.5, abs=0.01)


def test_errors_of_the_prediction_are_not_taken_for_offsets():
    """A prediction that drifts by 5 m deviates alike from all receivers: nothing is taken off."""
    offsets = Offsets(1, offset_time=10.0, handover_time=60.0)
    for k in range(1000):
        drift = np.array((5.0 * min(k / 500.0, 1.0),))
        offsets.update({'a': drift, 'b': drift}, {'a': 1.0, 'b': 3.0}, START + 200_000 * k)
        assert max(abs(offsets.of('a')[0]), abs(offsets.of('b')[0])) < 1e-9


def test_a_newcomer_begins_at_the_level_of_the_others():
    offsets = Offsets(1, offset_time=10.0, handover_time=60.0)
    zero = np.zeros(1)
    for k in range(200):
        offsets.update({'a': zero}, {'a': 1.0}, START + 200_000 * k)
    offsets.update({'a': zero, 'b': np.array((3.0,))}, {'a': 1.0, 'b': 1.0}, START + 40_000_000)
    assert offsets.of('b')[0] == pytest.approx(3.0)
    assert offsets.of('a')[0] == pytest.approx(0.0)
