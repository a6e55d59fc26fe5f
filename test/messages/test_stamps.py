"""Stamps: rounding and the refusal of unstamped messages."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import pytest

from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import checked_stamp
from ekf_fusion_ros.messages.stamps import microseconds
from ekf_fusion_ros.messages.stamps import seconds_nanoseconds


@pytest.mark.parametrize(('sec', 'nanosec', 'expected'), [
    (0, 499, 0), (0, 500, 1), (0, 1499, 1), (1, 999_999_499, 1_999_999),
    (1, 999_999_500, 2_000_000), (1_700_000_001, 84_000_000, 1_700_000_001_084_000),
])
def test_nearest_microsecond(sec, nanosec, expected):
    assert microseconds(sec, nanosec) == expected


@given(st.integers(0, 2**31 - 1), st.integers(0, 999_999))
def test_whole_microseconds_survive(sec, micro):
    assert seconds_nanoseconds(microseconds(sec, micro * 1000)) == (sec, micro * 1000)


@pytest.mark.parametrize(('sec', 'nanosec'), [(0, 0), (0, 400), (-5, 0)])
def test_unstamped_messages_are_refused(sec, nanosec):
    with pytest.raises(Refused, match=r'header\.stamp') as refused:
        checked_stamp(sec, nanosec)
    assert refused.value.reason == 'zero_stamp'


@pytest.mark.parametrize('nanosec', [1_000_000_000, 4_000_000_000])
def test_nanoseconds_beyond_a_second_are_refused(nanosec):
    with pytest.raises(Refused, match=r'header\.stamp\.nanosec') as refused:
        checked_stamp(1_700_000_000, nanosec)
    assert refused.value.reason == 'bad_stamp'
