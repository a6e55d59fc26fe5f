"""Heading of two antennas: gradient by differences."""

from __future__ import annotations

import math

from hypothesis import assume
from hypothesis import given
from hypothesis import settings
from hypothesis import strategies as st
import numpy as np
from oracles import difference
from oracles import quaternions
from oracles import sandwich

from ekf_fusion_ros.kernels.antenna_yaw import antenna_gradient


@settings(deadline=None, max_examples=60)
@given(q=quaternions(), offset=st.floats(-math.pi, math.pi))
def test_gradient(q, offset):
    def axis(q):
        return sandwich(q, np.array((math.cos(offset), math.sin(offset), 0.0)))

    north, east, _ = axis(q)
    assume(math.hypot(north, east) > 0.2 and abs(north) > 0.01)
    h = np.full(24, np.nan)
    assert antenna_gradient(q, offset, h)
    # by the angle between neighbours, so that a wrap does not matter
    turn = difference(
        lambda p: math.atan2(north * axis(p)[1] - east * axis(p)[0],
                             north * axis(p)[0] + east * axis(p)[1]), q)
    np.testing.assert_allclose(h[0:4], turn[0], rtol=1e-6, atol=1e-6)
    assert not h[4:].any()


def test_an_axis_to_the_east_is_left_out():
    q = np.array((math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))
    assert not antenna_gradient(q, 0.0, np.empty(24))
