"""Wrapping of angles."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from ekf_fusion_ros.mathlib.angles import wrap_pi


@given(st.floats(-1e4, 1e4))
def test_within_half_a_turn_and_the_same_direction(angle):
    wrapped = wrap_pi(angle)
    assert -math.pi <= wrapped < math.pi + 1e-9
    assert math.cos(wrapped - angle) == pytest.approx(1.0)


@pytest.mark.parametrize(('angle', 'expected'), [
    (0.0, 0.0), (math.pi, -math.pi), (-math.pi, -math.pi), (1.5 * math.pi, -0.5 * math.pi),
    (-1.5 * math.pi, 0.5 * math.pi), (7.0 * math.pi, -math.pi)])
def test_at_the_seam(angle, expected):
    assert wrap_pi(angle) == pytest.approx(expected)


def test_an_angle_inside_is_returned_as_it_is():
    assert wrap_pi(3.1) == 3.1
