"""Velocity in body axes and optical flow: gradients by differences."""

from __future__ import annotations

from hypothesis import given
from hypothesis import settings
import numpy as np
from oracles import conjugate
from oracles import covariance
from oracles import difference
from oracles import quaternions
from oracles import sandwich
from oracles import seeds
from oracles import vectors
import pytest

from ekf_fusion_ros.kernels.body_velocity import body_velocity
from ekf_fusion_ros.kernels.innovation import project
from ekf_fusion_ros.kernels.optical_flow import accumulate_motion
from ekf_fusion_ros.kernels.optical_flow import flow_jacobians

MANY = settings(deadline=None, max_examples=40)


def in_body(x):
    return sandwich(conjugate(x[0:4]), x[4:7])


@MANY
@given(q=quaternions(), velocity=vectors(3, 30.0))
def test_velocity_in_the_body_and_its_gradient(q, velocity):
    x = np.concatenate([q, velocity])
    body, jacobian = np.empty(3), np.full((3, 7), np.nan)
    body_velocity(q, velocity, body, jacobian)
    np.testing.assert_allclose(body, in_body(x), atol=1e-12)
    np.testing.assert_allclose(jacobian, difference(in_body, x, 1e-2), atol=1e-10)


@MANY
@given(q=quaternions(), velocity=vectors(3, 5.0))
def test_gradient_of_the_flow(q, velocity):
    def flow(x):
        x, y, _ = in_body(x)
        return np.array((y, -x)) / 4.0

    state = np.concatenate([q, velocity, np.zeros(17)])
    h = np.full((2, 24), np.nan)
    flow_jacobians(state, 4.0, h)
    np.testing.assert_allclose(h, difference(flow, state, 1e-2), atol=1e-10)


def test_forward_motion_is_seen_as_a_turn_about_minus_y():
    state = np.zeros(24)
    state[0], state[4] = 1.0, 3.0
    h = np.empty((2, 24))
    flow_jacobians(state, 2.0, h)
    assert h[:, 4:6] @ (3.0, 0.0) == pytest.approx((0.0, -1.5))


@MANY
@given(seed=seeds())
def test_motion_is_summed_and_low_passed(seed):
    rng = np.random.default_rng(seed)
    x, periods = rng.normal(size=24), rng.normal(size=(50, 8))
    turn, motion, share = np.zeros(4), np.zeros(4), 0.1
    for imu in periods:
        accumulate_motion(imu, x, share, turn, motion)
    np.testing.assert_allclose(turn[0:3], periods[:, 0:3].sum(axis=0) - 50 * x[10:13], atol=1e-9)
    assert turn[3] == pytest.approx(periods[:, 6].sum())
    weights = share * (1.0 - share) ** np.arange(49, -1, -1)
    np.testing.assert_allclose(motion[0:3], weights @ periods[:, 3:6] / 0.01, atol=1e-9)
    rates = np.linalg.norm(periods[:, 0:3], axis=1) / 0.01
    assert motion[3] == pytest.approx(max(rates * (1.0 - share) ** np.arange(49, -1, -1)))


@MANY
@given(seed=seeds())
def test_projection_of_the_covariance(seed):
    p, h = covariance(seed), np.random.default_rng(seed).normal(size=24)
    hp = np.empty(24)
    assert project(p, h, hp) == pytest.approx(np.einsum('i,ij,j', h, p, h), rel=1e-9)
    np.testing.assert_allclose(hp, np.einsum('i,ij->j', h, p), rtol=1e-9, atol=1e-12)
