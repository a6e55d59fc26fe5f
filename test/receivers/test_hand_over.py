"""Two receivers in flight: where one goes, comes back or lies, the output makes no step."""

from __future__ import annotations

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

SLOWLY_WRONG = {'fix': receiver(pos_noise=0.1, pos_correlated=0.5),
                'fix_2': receiver(pos_noise=0.16, pos_correlated=0.8)}
STEP = 0.3
EACH_SEED = [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in SEEDS[1:])]


def shifted(metres):
    return lambda _, fix: fix._replace(lat=fix.lat + metres * METRE)


BOTH_QUIET, APART = {'fix': QUIET, 'fix_2': QUIET}, {'fix_2': shifted(1.5)}


def change_of_gap(one, other, since):
    """Return by how much in m the outputs move against each other within a second."""
    pair = [flown.position[np.abs(flown.time - since - 0.5) < 0.5, 0:2] for flown in (one, other)]
    gap = pair[0] - pair[1]
    return np.linalg.norm(gap - gap[0], axis=1).max()


@pytest.mark.parametrize('seed', EACH_SEED)
@pytest.mark.parametrize('role', ['fix', 'fix_2'])
@pytest.mark.parametrize('change', [dropped, biased])
def test_no_step_where_one_goes_comes_back_or_lies(role, change, seed):
    """At each switch; later the outputs differ by the noise of the receiver that is left."""
    two = {'fix': BETTER, 'fix_2': WORSE}
    flown = fly(two, seed, {role: between(OFF, ON, change)}, until=ON + 2.0)
    for switch in (OFF, ON):
        assert change_of_gap(flown, fly(two, seed), switch) < STEP


@pytest.mark.slow
@pytest.mark.parametrize(('change', 'back'), [(dropped, ON), (biased, ON + 5.0)])
def test_one_that_comes_back_is_followed_gently(change, back):
    """With slow errors alone, which the noise does not hide, and of the better receiver.

    The output has drifted away with the other and has to return: not at once, but soon.
    """
    errors = []
    for seed in SEEDS:
        both = fly(SLOWLY_WRONG, seed)
        flown = fly(SLOWLY_WRONG, seed, {'fix': between(OFF, ON, change)})
        for switch in (OFF, back):
            assert change_of_gap(flown, both, switch) < STEP
        errors.append((flown.rms(back + 15.0), both.rms(back + 15.0)))
    returned, never_left = np.sqrt(np.mean(np.square(errors), axis=0))
    assert returned < 1.15 * never_left


@pytest.mark.parametrize('seed', EACH_SEED)
@pytest.mark.parametrize('role', ['fix', 'fix_2'])
def test_a_change_of_claimed_accuracy_makes_no_step(role, seed):
    poorer = between(OFF, ON, lambda fix: fix._replace(eph=3.0 * fix.eph, epv=3.0 * fix.epv))
    two = {'fix': BETTER, 'fix_2': WORSE}
    flown = fly(two, seed, {role: poorer}, until=ON + 2.0)
    for switch in (OFF, ON):
        assert change_of_gap(flown, fly(two, seed), switch) < STEP


@pytest.fixture(scope='module')
def disagreeing():
    return fly(BOTH_QUIET, 0, APART)


@pytest.mark.parametrize('role', ['fix', 'fix_2'])
@pytest.mark.parametrize('change', [dropped, biased])
def test_receivers_that_disagree_hand_over_slowly(disagreeing, role, change):
    """Of two without noise, 1.5 m apart, either may go or lie: the output stays."""
    window = between(OFF, ON, change)
    both = {**APART, role: lambda t, fix: (
        APART.get(role, lambda _, same: same)(t, window(t, fix)) if window(t, fix) else None)}
    assert moved(disagreeing, fly(BOTH_QUIET, 0, both), SETTLED) < STEP
    between_both = disagreeing.error[disagreeing.time > SETTLED, 0].mean()
    assert between_both == pytest.approx(0.75, abs=0.1)
