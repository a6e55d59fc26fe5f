"""The take-off navigation test at its thresholds and a step beside them."""

from __future__ import annotations

import pytest

from ekf_fusion_ros.estimator import AidStatus
from ekf_fusion_ros.health.takeoff_test import TakeoffTest
from ekf_fusion_ros.health.takeoff_test import Verdict
from ekf_fusion_ros.health.takeoff_test import innovations_pass

SECOND = 1_000_000
TAKEOFF = 100 * SECOND


@pytest.fixture
def fly():
    """A test that stood armed on the ground until TAKEOFF, and how to step it after that."""
    test = TakeoffTest()
    test.step(TAKEOFF, 0.0, lambda: True, standby=False, landed=True)

    def step(time_us, speed=0.0, *, good=True, landed=False, standby=False):
        test.step(TAKEOFF + time_us, speed, lambda: good, standby=standby, landed=landed)
        return test.verdict
    return step


@pytest.mark.parametrize(('time_us', 'expected'), [
    (30 * SECOND - 1, Verdict.OPEN), (30 * SECOND, Verdict.OPEN),
    (30 * SECOND + 1, Verdict.PASSED)])
def test_passes_after_thirty_seconds(fly, time_us, expected):
    assert fly(time_us) is expected


@pytest.mark.parametrize(('speed', 'expected'), [
    (4.999, Verdict.OPEN), (5.0, Verdict.OPEN), (5.001, Verdict.PASSED)])
def test_passes_at_speed(fly, speed, expected):
    assert fly(SECOND, speed) is expected


@pytest.mark.parametrize(('time_us', 'expected'), [
    (SECOND - 1, Verdict.OPEN), (SECOND, Verdict.OPEN), (SECOND + 1, Verdict.FAILED)])
def test_fails_after_a_second_of_failing_innovations(fly, time_us, expected):
    assert fly(1, good=False) is Verdict.OPEN
    assert fly(time_us, good=False) is expected


def test_one_good_innovation_begins_the_second_again(fly):
    fly(900_000, good=False)
    fly(950_000, good=True)
    assert fly(1_950_000, good=False) is Verdict.OPEN
    assert fly(1_950_001, good=False) is Verdict.FAILED


def test_failure_and_speed_in_one_step_is_failure(fly):
    assert fly(SECOND + 1, 6.0, good=False) is Verdict.FAILED


def test_failure_is_kept_through_good_innovations_and_landing(fly):
    fly(2 * SECOND, good=False)
    assert fly(3 * SECOND, 9.0) is Verdict.FAILED
    assert fly(60 * SECOND, landed=True) is Verdict.FAILED


def test_success_ends_the_test(fly):
    fly(SECOND, 6.0)
    assert fly(20 * SECOND, good=False) is Verdict.PASSED


@pytest.mark.parametrize('verdict', [Verdict.PASSED, Verdict.FAILED])
def test_standby_forgets_the_verdict(fly, verdict):
    assert fly(2 * SECOND, 6.0, good=verdict is Verdict.PASSED) is verdict
    assert fly(10 * SECOND, landed=True, standby=True) is Verdict.OPEN
    # The next flight is tested from its own take-off on.
    assert fly(10 * SECOND + 1) is Verdict.OPEN
    assert fly(39 * SECOND) is Verdict.OPEN
    assert fly(41 * SECOND) is Verdict.PASSED


def test_time_on_the_ground_does_not_count(fly):
    fly(100 * SECOND, landed=True, good=False)
    assert fly(101 * SECOND, good=False) is Verdict.OPEN
    assert fly(101 * SECOND + 1, good=False) is Verdict.FAILED


def test_innovations_are_asked_for_only_while_it_counts():
    def never():
        raise AssertionError

    test = TakeoffTest()
    test.step(TAKEOFF, 0.0, never, standby=True, landed=True)
    test.step(TAKEOFF + 1, 0.0, never, standby=False, landed=True)
    test.step(TAKEOFF + 2, 6.0, lambda: True, standby=False, landed=False)
    test.step(TAKEOFF + 3, 0.0, never, standby=False, landed=False)


def test_a_jump_of_the_stamps_begins_an_open_test_again(fly):
    test = TakeoffTest()
    test.step(TAKEOFF, 0.0, lambda: True, standby=False, landed=True)
    test.forget_time()
    test.step(TAKEOFF + 3600 * SECOND, 0.0, lambda: False, standby=False, landed=False)
    assert test.verdict is Verdict.OPEN


def aid(name, ratio, *, active=True):
    return AidStatus(name, active, 0, (0.0,), (1.0,), ratio, ratio > 1.0, 0, 0, 0, 0, 0, 0)


@pytest.mark.parametrize(('aids', 'expected'), [
    ([], True),
    ([aid('gnss_velocity', 0.999), aid('gnss_position', 0.999)], True),
    ([aid('gnss_velocity', 1.0), aid('gnss_position', 0.1)], False),
    ([aid('gnss_velocity', 0.1), aid('gnss_position', 1.0)], False),
    ([aid('gnss_vertical_velocity', 1.0)], False),
    ([aid('vision_velocity', 1.1)], False),
    ([aid('vision_velocity', 1.1, active=False)], True),
    ([aid('gnss_position', 0.1), aid('optical_flow', 5.0)], True),
    ([aid('optical_flow', 5.0)], False),
    ([aid('fake_position', 5.0), aid('magnetic_field', 5.0), aid('baro_height', 5.0)], True),
])
def test_innovations_of_horizontal_aids_in_use_count(aids, expected):
    assert innovations_pass(aids) is expected
