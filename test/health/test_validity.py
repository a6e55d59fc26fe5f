"""A validity flag: set, hold, probation and clear, at the thresholds and a step beside them."""

from __future__ import annotations

import pytest

from ekf_fusion_ros.health.validity import ValidityFlag
from ekf_fusion_ros.params.health import HealthParams

LIMIT = 5.0
START = 50_000_000
SECOND = 1_000_000


def judge(flag, time_us, accuracy=1.0, *, available=True, landed=False):
    flag.step(START + time_us, accuracy, available=available, landed=landed)
    return flag.valid


@pytest.fixture
def flag():
    """A flag whose boot is the time START."""
    one = ValidityFlag(LIMIT, HealthParams())
    judge(one, 0)
    return one


@pytest.fixture
def valid(flag):
    """A flag that has become valid 2 s after START."""
    assert judge(flag, 2 * SECOND)
    return flag


@pytest.mark.parametrize(('accuracy', 'expected'), [
    (4.999999, True), (5.0, False), (5.000001, False), (float('nan'), False)])
def test_set_below_the_limit(flag, accuracy, expected):
    assert judge(flag, 2 * SECOND, accuracy) is expected


@pytest.mark.parametrize(('accuracy', 'expected'), [
    (5.1, True), (12.499999, True), (12.5, False), (12.500001, False), (float('nan'), False)])
def test_held_up_to_two_and_a_half_limits(valid, accuracy, expected):
    assert judge(valid, 3 * SECOND, accuracy) is expected


def test_not_available_is_not_valid(flag):
    assert not judge(flag, 2 * SECOND, 1.0, available=False)


def test_cleared_at_once_when_not_available(valid):
    assert not judge(valid, 2 * SECOND + 1, 1.0, available=False)


@pytest.mark.parametrize(('time_us', 'expected'), [
    (SECOND - 1, False), (SECOND, False), (SECOND + 1, True)])
def test_set_after_more_than_the_shortest_probation(flag, time_us, expected):
    assert judge(flag, time_us) is expected


@pytest.mark.parametrize(('time_us', 'expected'), [
    (10 * SECOND, False), (10 * SECOND + 1, True)])
def test_set_again_a_probation_after_the_last_failure(valid, time_us, expected):
    judge(valid, 9 * SECOND, 20.0)
    assert not judge(valid, 9 * SECOND + 1)
    assert judge(valid, time_us) is expected


def test_what_was_never_valid_need_not_be_good_for_long(flag):
    judge(flag, 60 * SECOND, 20.0)
    assert not judge(flag, 61 * SECOND)
    assert judge(flag, 61 * SECOND + 1)


def test_a_loss_alone_does_not_lengthen_probation(valid):
    judge(valid, 9 * SECOND, 20.0)
    assert valid.probation == 1.0


@pytest.mark.parametrize('steps', [1, 7, 1000])
def test_probation_grows_by_the_gain_for_each_second_of_failure(valid, steps):
    """Fails from 9 s to 11 s: 1 + 10 * 2 = 21 s, whatever the rate of steps."""
    for step in range(steps + 1):
        judge(valid, 9 * SECOND + round(2 * SECOND * step / steps), 20.0)
    assert valid.probation == pytest.approx(21.0, abs=1e-4)
    assert not judge(valid, 31_999_000)
    assert judge(valid, 32_001_000)


@pytest.mark.parametrize(('seconds', 'expected'), [(9.8, 99.0), (9.9, 100.0), (10.0, 100.0)])
def test_probation_grows_to_a_hundred_seconds(valid, seconds, expected):
    judge(valid, 9 * SECOND, 20.0)
    judge(valid, 9 * SECOND + round(seconds * SECOND), 20.0)
    assert valid.probation == pytest.approx(expected)


@pytest.mark.parametrize('steps', [1, 9, 500])
def test_probation_of_take_off_falls_a_second_a_second(valid, steps):
    """From 30 s at 2 s; PX4 takes the time since the last failure again with every step."""
    valid.take_off()
    for step in range(1, steps + 1):
        judge(valid, 2 * SECOND + round(20 * SECOND * step / steps))
    assert valid.probation == pytest.approx(10.0, abs=1e-6)


@pytest.mark.parametrize(('seconds', 'expected'), [(28.9, 1.1), (29.0, 1.0), (29.1, 1.0)])
def test_probation_falls_to_one_second(valid, seconds, expected):
    valid.take_off()
    judge(valid, 2 * SECOND + round(seconds * SECOND))
    assert valid.probation == pytest.approx(expected)


def test_lost_right_after_take_off_means_thirty_seconds(valid):
    valid.take_off()
    judge(valid, 2 * SECOND + 1, 20.0)
    assert not judge(valid, 32 * SECOND + 1)
    assert judge(valid, 32 * SECOND + 2)


def test_on_the_ground_a_second_is_enough(valid):
    valid.take_off()
    judge(valid, 3 * SECOND, 20.0)
    assert not judge(valid, 4 * SECOND, landed=True)
    assert judge(valid, 4 * SECOND + 1, landed=True)


def test_withdrawn_counts_as_a_failure(valid):
    assert valid.withdraw(START + 5 * SECOND)
    assert not valid.valid
    assert not valid.withdraw(START + 6 * SECOND)
    assert not judge(valid, 7 * SECOND)
    assert judge(valid, 7 * SECOND + 1)


def test_change_is_told_once(flag):
    def step(time_us, accuracy=1.0):
        return flag.step(START + time_us, accuracy, available=True, landed=False)

    assert [step(t * SECOND) for t in (1, 2, 3)] == [False, True, False]
    assert [step(t * SECOND, 20.0) for t in (4, 5)] == [True, False]
    assert flag.invalid_since_us == START + 4 * SECOND


def test_what_remains_of_the_probation(flag):
    judge(flag, 250_000)
    assert flag.remaining() == pytest.approx(0.75)
    judge(flag, 300_000, 20.0)
    assert flag.remaining() == 0.0


def test_the_parameters_count():
    flag = ValidityFlag(1.0, HealthParams(probation_gain=0.0, takeoff_probation=3.0))
    judge(flag, 0, 0.5)
    assert judge(flag, 2 * SECOND, 0.5)
    judge(flag, 3 * SECOND, 3.0)
    judge(flag, 50 * SECOND, 3.0)
    assert flag.probation == 1.0
    flag.take_off()
    assert flag.probation == 3.0
