"""Gaps between rows and restarts, in sentences."""

from __future__ import annotations

import pytest

from ekf_fusion_ros.replay.breaks import OutputGaps
from ekf_fusion_ros.replay.breaks import restart_warnings

START = 1_000_000_000


def told(rate, seconds, end):
    gaps = OutputGaps(rate)
    for second in seconds:
        gaps.note([START + round(1e6 * second)])
    return gaps.warnings(START, START + round(1e6 * end))


@pytest.mark.parametrize(('seconds', 'end', 'words'), [
    ([10, 11, 14, 15, 19.5, 20], 21, 'no output for 4.5 s, from 15.0 s after the start on'),
    ([10, 11], 14, 'no output for 3.0 s, from 11.0 s'),
    # A second pass of a looped recording is not a gap, and neither is the time before.
    ([10, 11, 1, 2, 4.5], 4.5, 'no output for 2.5 s, from 2.0 s'),
])
def test_the_longest_gap_is_told(seconds, end, words):
    line, = told(50.0, seconds, end)
    assert line.startswith(words)


def test_what_is_no_gap():
    assert told(50.0, [], 20) == []
    assert told(50.0, [10, 11.9], 13.8) == []
    assert told(0.25, [8, 12, 16], 20) == []


def test_stamps_of_another_clock_say_nothing_of_the_end():
    gaps = OutputGaps(50.0)
    for second in (3.0, 3.1):
        gaps.note([round(1e6 * second)])
    assert gaps.warnings(START, START + 90_000_000) == []


def test_restarts():
    assert restart_warnings(0, None, START) == []
    assert restart_warnings(1, START + 1_500_000, START) == [
        'the estimator started again once, 1.5 s after the start; the events say why']
    assert restart_warnings(3, START + 1_500_000, START) == [
        'the estimator started again 3 times, first 1.5 s after the start; the events say why']
    assert restart_warnings(2, None, START) == [
        'the estimator started again 2 times; the events say why']
