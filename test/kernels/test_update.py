"""The scalar update against the information form, and the limits that follow it."""

from __future__ import annotations

from hypothesis import given
from hypothesis import settings
import numpy as np
from oracles import covariance
from oracles import seeds
import pytest

from ekf_fusion_ros.kernels.update import apply_direct
from ekf_fusion_ros.kernels.update import apply_update
from ekf_fusion_ros.kernels.update import fuse_state
from ekf_fusion_ros.kernels.update import fuse_two_states
from ekf_fusion_ros.kernels.update import limit_covariance

ALL_FREE = np.array((0.0, 0.0, 0.0, 1.0, 1.0, 1.0))


def state(seed):
    x = np.random.default_rng(seed).normal(size=24)
    x[0:4] /= np.linalg.norm(x[0:4])
    return x


@settings(deadline=None, max_examples=25)
@given(seed=seeds())
def test_update_is_that_of_the_information_form(seed):
    p, x = covariance(seed), state(seed)
    h = np.random.default_rng(seed + 1).normal(size=24)
    noise = float(h @ p @ h) * 0.3
    expected = np.linalg.inv(np.linalg.inv(p) + np.outer(h, h) / noise)
    moved = x - 0.01 * expected @ h / noise
    moved[0:4] /= np.linalg.norm(moved[0:4])
    gain = p @ h / (h @ p @ h + noise)
    out = p.copy()
    assert apply_update(out, x, gain, h @ p, 0.01, ALL_FREE)
    np.testing.assert_allclose(out, expected, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(x, moved, atol=1e-9)


@settings(deadline=None, max_examples=25)
@given(seed=seeds())
def test_direct_observation_of_a_state(seed):
    p, x = covariance(seed), state(seed)
    noise = 0.4
    h = np.eye(24)[8]
    expected = np.linalg.inv(np.linalg.inv(p) + np.outer(h, h) / noise)
    before = x[8]
    out = p.copy()
    assert apply_direct(out, x, 8, p[8, 8] + noise, 2.0, ALL_FREE)
    np.testing.assert_allclose(out, expected, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(x[8], before - 2.0 * p[8, 8] / (p[8, 8] + noise))


def test_two_states_use_the_innovations_from_before_the_first():
    p, x = covariance(6), state(6)
    before, out = x.copy(), p.copy()
    north, east, ratio, faults = fuse_two_states(
        out, x, 7, 0.5, -0.2, 0.4, 0.6, 3.0, 1.0, ALL_FREE)
    variance = p[7, 7] + 0.4, p[8, 8] + 0.6
    assert (north, east) == pytest.approx(variance)
    assert ratio == pytest.approx(max(0.25 / (9.0 * north), 0.04 / (9.0 * east)))
    assert faults == 0
    first = p - np.outer(p[:, 7], p[7]) / variance[0]
    second = first - np.outer(first[:, 8], first[8]) / variance[1]
    np.testing.assert_allclose(out, second, rtol=1e-9, atol=1e-12)
    moved = before - 0.5 * p[:, 7] / variance[0] + 0.2 * first[:, 8] / variance[1]
    np.testing.assert_allclose(x[4:], moved[4:], atol=1e-12)


@pytest.mark.parametrize(('bad', 'word'), [(7, 1), (8, 2)])
def test_two_states_tell_which_observation_was_unhealthy(bad, word):
    p, x = covariance(6), state(6)
    noise = {7: 0.4, 8: 0.6}
    noise[bad] = -0.5 * p[bad, bad]
    found = fuse_two_states(p, x, 7, 0.1, 0.1, noise[7], noise[8], 3.0, 1.0, ALL_FREE)
    assert found[3] == word


@pytest.mark.parametrize('sigmas', [2.9, 3.1])
def test_a_gate_is_a_number_of_sigmas(sigmas):
    p, x = covariance(6), state(6)
    before, out = x.copy(), p.copy()
    sigma = np.sqrt(p[9, 9] + 0.4)
    variance, ratio, healthy = fuse_state(out, x, 9, sigmas * sigma, 0.4, 3.0, ALL_FREE)
    assert variance == pytest.approx(sigma ** 2)
    assert ratio == pytest.approx((sigmas / 3.0) ** 2)
    assert healthy
    assert np.array_equal(x, before) is (sigmas > 3.0)
    assert np.array_equal(out, p) is (sigmas > 3.0)


def test_an_update_that_would_make_a_variance_negative_is_refused():
    p, x = covariance(2), state(2)
    before, gain = x.copy(), np.zeros(24)
    gain[5] = 3.0
    assert not apply_update(p, x, gain, p[5].copy(), 1.0, ALL_FREE)
    np.testing.assert_array_equal(x, before)
    assert not p[5].any()
    assert not p[:, 5].any()
    assert p[6, 6] > 0.0


def limited(p, inhibited=(0.0, 0.0, 0.0), bias_max=1.0, mag=True, wind=True):
    out = p.copy()
    limit_covariance(out, np.array((*inhibited, mag, wind, bias_max), dtype=float))
    return out


def test_a_sound_covariance_passes_unchanged():
    p = covariance(1)
    np.testing.assert_allclose(limited(p), p, rtol=1e-15)


def test_halves_are_averaged_where_a_gain_is_cut():
    p, x = covariance(1), state(1)
    p = 0.5 * (p + p.T)
    hp, gain = p[8].copy(), p[:, 8] / (p[8, 8] + 0.3)
    gain[16:24] = 0.0
    whole = p - np.outer(gain, hp)
    out = p.copy()
    assert apply_update(out, x, gain, hp, 0.1, ALL_FREE)
    np.testing.assert_array_equal(out, out.T)
    np.testing.assert_allclose(out, 0.5 * (whole + whole.T), rtol=1e-12, atol=1e-15)


def test_variances_are_clamped():
    p = np.zeros((24, 24))
    np.testing.assert_array_equal(np.diag(limited(p))[4:10], np.full(6, 1e-6))
    assert limited(np.diag(np.full(24, -1.0))).min() >= 0.0
    np.testing.assert_array_equal(
        np.diag(limited(np.diag(np.full(24, 1e9)), bias_max=9e-5)),
        np.repeat((1.0, 1e6, 1.0, 9e-5, 1.0, 1e6), (4, 6, 3, 3, 6, 2)))


def test_accelerometer_bias_variances_stay_within_a_ratio_of_a_hundred():
    p = np.diag(np.full(24, 1e-3))
    p[13, 13], p[14, 14], p[15, 15] = 4e-5, 4e-5, 1e-8
    assert limited(p)[15, 15] == pytest.approx(4e-7)
    p[13, 13] = p[14, 14] = 1e-7
    assert limited(p)[15, 15] == pytest.approx(5e-8)
    kept = limited(p, inhibited=(0.0, 0.0, 1.0))
    assert kept[15, 15] == 1e-8


def test_a_collapsed_bias_variance_decorrelates_all_three():
    p = covariance(4)
    p[15, 15] = 1e-12
    out = limited(p)
    block = out[13:16]
    assert np.count_nonzero(block) == 3
    assert out[4, 5] == p[4, 5]


def test_inactive_blocks_are_zero():
    p = covariance(7)
    out = limited(p, mag=False, wind=False)
    assert not out[16:24].any()
    assert not out[:, 16:24].any()
    assert out[15, 15] > 0.0
