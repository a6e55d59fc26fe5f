"""Rules of the delayed FIFO."""

from __future__ import annotations

import pytest

from ekf_fusion_ros.buffer import OVERTAKEN
from ekf_fusion_ros.buffer import PUSHED_OUT
from ekf_fusion_ros.buffer import TOO_CLOSE
from ekf_fusion_ros.buffer import SampleBuffer


@pytest.fixture
def three():
    """A buffer with samples a, b, c at 100, 200 and 300 ms."""
    buffer = SampleBuffer(3)
    for time_us, name in ((100_000, 'a'), (200_000, 'b'), (300_000, 'c')):
        buffer.push(time_us, name)
    return buffer


def test_a_sample_ahead_of_the_horizon_waits(three):
    assert three.pop_first_older_than(99_999) is None
    assert len(three) == 3


def test_the_horizon_may_equal_the_stamp(three):
    assert three.pop_first_older_than(100_000) == (100_000, 'a')
    assert len(three) == 2


def test_the_newest_sample_behind_the_horizon_is_taken_and_older_ones_are_missed(three):
    assert three.pop_first_older_than(250_000) == (200_000, 'b')
    assert three.passed_over == {OVERTAKEN: 1}
    assert len(three) == 1
    assert three.pop_first_older_than(300_000) == (300_000, 'c')


@pytest.mark.parametrize(('horizon', 'found'), [(399_999, (300_000, 'c')), (400_000, None)])
def test_a_sample_is_too_late_after_a_tenth_of_a_second(three, horizon, found):
    assert three.pop_first_older_than(horizon) == found


def test_samples_that_are_too_late_do_not_block_newer_ones(three):
    assert three.pop_first_older_than(450_000) is None
    three.push(440_000, 'd')
    assert three.pop_first_older_than(450_000) == (440_000, 'd')
    assert len(three) == 0


def test_the_oldest_is_dropped_when_full(three):
    three.push(400_000, 'd')
    assert len(three) == 3
    assert three.passed_over == {PUSHED_OUT: 1}
    assert three.pop_first_older_than(150_000) is None
    assert three.pop_first_older_than(200_000) == (200_000, 'b')


def test_the_newest_stays_readable_but_is_not_recent_once_taken(three):
    three.pop_first_older_than(300_000)
    assert three.newest == 'c'
    assert three.newest_time_us == 0
    three.push(500_000, 'e')
    assert three.newest_time_us == 500_000


def test_nothing_in_nothing_out():
    buffer = SampleBuffer(2)
    assert buffer.pop_first_older_than(10**12) is None
    assert buffer.newest is None


def test_waiting_samples_can_be_changed(three):
    three.replace(str.upper)
    assert three.pop_first_older_than(200_000) == (200_000, 'B')


def test_samples_too_close_to_the_one_before_are_counted():
    buffer = SampleBuffer(3)
    assert [buffer.admits(time_us, 20_000) for time_us in (100_000, 120_000, 120_001)] == [
        True, False, True]
    assert buffer.passed_over == {TOO_CLOSE: 1}
