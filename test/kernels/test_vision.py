"""Odometry turned into the filter's frame, against dense algebra."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import settings
import numpy as np
from oracles import quaternions
from oracles import to_scipy
from oracles import vectors
import pytest

from ekf_fusion_ros.kernels.vision import turn_displacement
from ekf_fusion_ros.kernels.vision import turn_velocity

SPREAD = np.array(((0.4, 0.1, -0.05), (0.1, 0.3, 0.02), (-0.05, 0.02, 0.9)))
FEW = settings(deadline=None, max_examples=25)


def matrix(q):
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    return rotation.from_quat(to_scipy(q)).as_matrix()


@FEW
@given(q=quaternions(), velocity=vectors(3, 20.0))
def test_velocity_and_its_variances_turn_with_the_frame(q, velocity):
    turn = matrix(q)
    turned, variance = turn_velocity(turn, velocity, SPREAD)
    np.testing.assert_allclose(turned, turn @ velocity, atol=1e-12)
    np.testing.assert_allclose(variance, np.diag(turn @ SPREAD @ turn.T), atol=1e-12)


@FEW
@given(q=quaternions(), before=vectors(3, 20.0), after=vectors(3, 20.0))
def test_a_displacement_carries_the_noise_of_both_ends(q, before, after):
    turn, spread = matrix(q), np.array((0.4, 0.3, 0.9))
    found = turn_displacement(turn, after, spread, before, 2.0 * spread)
    np.testing.assert_allclose(found[0:2], (turn @ (after - before))[0:2], atol=1e-12)
    np.testing.assert_allclose(
        found[2:4], np.diag(turn @ np.diag(3.0 * spread) @ turn.T)[0:2], atol=1e-12)


def test_an_unmeasured_height_does_not_reach_north_and_east():
    turn = matrix(np.array((math.cos(0.2), 0.0, math.sin(0.2), 0.0)))
    after, spread = np.array((3.0, 4.0, math.nan)), np.array((0.4, 0.3, math.nan))
    found = turn_displacement(turn, after, spread, np.zeros(3), np.zeros(3))
    np.testing.assert_allclose(
        found, (3.0 * math.cos(0.4), 4.0, 0.4 * math.cos(0.4) ** 2, 0.3), atol=1e-12)
