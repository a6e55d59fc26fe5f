"""Straight to machine code: the same result, and only where one signature is known."""

from __future__ import annotations

import numpy as np
import pytest

from ekf_fusion_ros.kernels.compile import COMPILED
from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.kernels.compile import machine_code


def _doubled(v, scale):
    v[0] *= scale
    return 2.0 * v[1]


def test_a_kernel_that_was_never_called_stays_itself():
    one = kernel(_doubled)
    assert machine_code(one) is one


def test_a_compiled_kernel_gives_the_same_past_the_search():
    one, v = kernel(_doubled), np.array((1.0, 2.0))
    one(v, 3.0)
    straight = machine_code(one)
    assert (straight is one) != COMPILED
    assert straight(v, 3) == 4.0
    assert v[0] == 9.0


@pytest.mark.skipif(not COMPILED, reason='plain Python has no signatures')
def test_a_kernel_of_two_signatures_stays_itself():
    one = kernel(_doubled)
    one(np.ones(2), 3.0)
    one(np.ones(2, np.float32), 3.0)
    assert machine_code(one) is one
