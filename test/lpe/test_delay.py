"""The delayed states, and the low pass on corrections."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.lpe.delay import DelayedStates
from ekf_fusion_ros.lpe.smoothing import Smoothing


def at(seconds):
    """A state that moves along a straight line."""
    return np.full(10, seconds)


@pytest.fixture
def history():
    states = DelayedStates()
    for k in range(0, 2001, 4):
        states.note(1000 * k, at(1e-3 * k))
    return states


@pytest.mark.parametrize('delay', [0.0, 0.003, 0.11, 0.29, 0.4999])
def test_a_straight_line_is_met_at_any_delay(history, delay):
    state = history.at(round(1e6 * (2.0 - delay)), 2_000_000, at(2.0))
    assert state[0] == pytest.approx(2.0 - delay, abs=1e-9)


def test_too_late_is_none_and_the_future_is_now(history):
    assert history.at(1_499_999, 2_000_000, at(2.0)) is None
    assert history.at(2_100_000, 2_000_000, at(2.0))[0] == 2.0
    assert DelayedStates().at(900_000, 1_000_000, at(1.0)) is None


def test_the_past_moves_with_the_frame(history):
    history.move(at(5.0))
    assert history.at(1_700_000, 2_000_000, at(7.0))[0] == pytest.approx(6.7)


def test_a_correction_enters_as_a_first_order_low_pass_lets_it():
    smoothing, x = Smoothing(), np.zeros(10)
    x[0] += 2.0
    smoothing.note(x.copy())
    assert smoothing.published(x)[0] == 0.0
    for _ in range(100):
        smoothing.step(0.001, cut_off=5.0)
    left = math.exp(-2.0 * math.pi * 5.0 * 0.1)
    assert smoothing.published(x)[0] == pytest.approx(2.0 * (1.0 - left))
    smoothing.step(0.001, cut_off=0.0)
    assert smoothing.published(x)[0] == 2.0
