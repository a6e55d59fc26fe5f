"""Two receivers in flight against the truth: the blend, bias, rates, loss."""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
import pytest
from receivers.cases import BETTER
from receivers.cases import METRE
from receivers.cases import OFF
from receivers.cases import ON
from receivers.cases import QUIET
from receivers.cases import SEEDS
from receivers.cases import SETTLED
from receivers.cases import WORSE
from receivers.cases import between
from receivers.cases import biased
from receivers.cases import dropped
from receivers.flight import fly
from receivers.flight import moved
from receivers.flight import receiver

from ekf_fusion_ros.samples import NAN3


def drifting(speed, since=SETTLED):
    """Return what moves fixes north by ever more."""
    return lambda t, fix: fix._replace(lat=fix.lat + max(0.0, speed * (t - since)) * METRE)


def excluded_from(flown):
    """Return whose position was ever excluded."""
    return {text.split(':')[0] for text in flown.events if 'position excluded' in text}


@pytest.mark.slow
def test_the_blend_beats_the_better_receiver():
    """In the fixes that the filter gets and in its output, over seeds and nearly in each."""
    flights = {seed: fly({'fix': BETTER, 'fix_2': WORSE}, seed) for seed in SEEDS}
    alone = {seed: fly({'fix': BETTER}, seed) for seed in SEEDS}
    output = [(flights[seed].rms(SETTLED), alone[seed].rms(SETTLED)) for seed in SEEDS]
    fixes = [(flights[seed].blend_rms(SETTLED, 0.11), alone[seed].blend_rms(SETTLED, 0.11))
             for seed in SEEDS]
    for pairs in (output, fixes):
        both, better = np.sqrt(np.mean(np.square(pairs), axis=0))
        assert both < 0.9 * better
        assert sum(one < other for one, other in pairs) >= len(SEEDS) - 1


@pytest.mark.parametrize('role', ['fix', 'fix_2', 'fix_3'])
def test_of_three_one_that_drifts_away_is_found_out(role):
    """At 0.3 m/s, slowly enough to take the estimate along, to 22 m."""
    three = {'fix': BETTER, 'fix_2': WORSE, 'fix_3': WORSE}
    flown = fly(three, 1, {role: drifting(0.3)})
    assert excluded_from(flown) == {role}
    honest = fly(three, 1)
    assert not excluded_from(honest)
    # Until then it takes the estimate along by its weight.
    assert moved(flown, honest, SETTLED) < 5.0


def test_of_two_a_drift_is_bounded_by_the_gate():
    """The worse one drifts: it is excluded, the other never is."""
    flown = fly({'fix': BETTER, 'fix_2': WORSE}, 1, {'fix_2': drifting(0.3)})
    assert excluded_from(flown) == {'fix_2'}
    assert np.abs(flown.error[flown.time > SETTLED, 0]).max() < 5.0


def test_a_lie_is_told_and_excluded_until_it_ends():
    flown = fly({'fix': BETTER, 'fix_2': WORSE}, 0, {'fix_2': between(OFF, ON, biased)})
    told = [text for text in flown.events if text.startswith('fix_2')]
    assert len(told) == 3
    assert told[1].startswith('fix_2: position excluded, ')
    assert told[2] == 'fix_2: position agrees again, admitted'
    counts = flown.session.statistics()
    # 15 s of lie and 5 s of probation at 5 Hz; the other loses none.
    assert counts['fix_2'].passed_over['left_out_of_blend'] == pytest.approx(100, abs=3)
    assert counts['fix'].passed_over['left_out_of_blend'] == 0


def test_a_lie_from_the_start_does_not_place_the_vehicle():
    """Without a prediction the receiver that claims to be better decides."""
    flown = fly({'fix': WORSE, 'fix_2': BETTER}, 0, {'fix': lambda _, fix: biased(fix)})
    assert np.abs(flown.error[flown.time > SETTLED]).max() < 3.5


def test_rates_delays_and_antennas_of_their_own():
    """A slow late receiver on a boom with a quick one: as good as both on the same terms."""
    slow = receiver(pos_noise=0.05, pos_correlated=0.0, rate=1.0, phase=0.37, stamp_delay=0.2,
                    lever_arm=(-0.6, 0.8, -1.0))
    quick = replace(QUIET, rate=10.0, lever_arm=(1.0, 0.0, -0.5))
    own = {'receivers.fix_2.delay_ms': 200.0, 'messages.fix_2.mount_xyz': '-0.6, -0.8, 1.0',
           'messages.fix.mount_xyz': '1.0, 0.0, 0.5'}
    flown = fly({'fix': quick, 'fix_2': slow}, overrides=own)
    plain = fly({'fix': QUIET, 'fix_2': QUIET})
    assert flown.rms(SETTLED) < plain.rms(SETTLED) + 0.05
    offset = [status.offset for status in flown.session.receivers()]
    np.testing.assert_allclose(offset, 0.0, atol=0.1)
    wrong = fly({'fix': quick, 'fix_2': slow}, overrides={
        name: value for name, value in own.items() if 'fix_2' not in name})
    assert flown.rms(SETTLED) < wrong.rms(SETTLED)


def test_velocity_of_one_alone_is_the_velocity_of_the_blend():
    flown = fly({'fix': replace(BETTER, has_velocity=False), 'fix_2': WORSE})
    weights = [status.weights[2] for status in flown.session.receivers()]
    assert weights == [0.0, 1.0]
    assert flown.session.receivers()[0].obstacles == {'velocity': 'not measured'}
    assert all(fix.has_velocity for fix in flown.fixes[5:-5])
    assert flown.rms(SETTLED) < fly(
        {'fix': replace(BETTER, has_velocity=False)}).rms(SETTLED)


def test_loss_of_both_and_return():
    window = between(OFF, ON, dropped)
    flown = fly({'fix': BETTER, 'fix_2': WORSE}, 0, {'fix': window, 'fix_2': window})
    told = [text for text in flown.events if 'receiver is' in text]
    assert len(told) == 6 and sum('silent' in text for text in told) == 2
    assert not [fix for fix in flown.fixes if math.isnan(fix.lat)]
    assert flown.rms(ON + 15.0) < 2.0


def test_a_second_receiver_that_never_speaks_changes_nothing():
    alone = fly({'fix': BETTER})
    silent = fly({'fix': BETTER, 'fix_2': WORSE}, 0, {'fix_2': lambda t, fix: None})
    np.testing.assert_allclose(silent.position, alone.position, atol=1e-6)


def test_the_first_may_be_silent():
    flown = fly({'fix': BETTER, 'fix_2': WORSE}, 0, {'fix': lambda t, fix: None})
    assert flown.rms(SETTLED) < 2.0
    assert flown.session.waiting_role == ''


def test_a_velocity_may_be_missing_at_times():
    flown = fly({'fix': BETTER, 'fix_2': WORSE}, 0, {
        'fix': lambda t, fix: fix._replace(velocity=NAN3, sacc=math.nan)
        if round(5 * t) % 3 == 0 else fix})
    assert flown.rms(SETTLED) < 1.5
