"""Track arithmetic against numbers by hand and against scipy."""

import numpy as np
import pytest

from ekf_fusion_ros.analysis.errors import Track
from ekf_fusion_ros.analysis.errors import align
from ekf_fusion_ros.analysis.errors import horizontal
from ekf_fusion_ros.analysis.errors import inside
from ekf_fusion_ros.analysis.errors import rms

ROAD = Track(np.array([0.0, 1.0, 3.0]), np.array([[0.0, 0, 0], [2.0, 4.0, 6.0], [6.0, 8.0, 0.0]]))


def test_track_between_and_beyond_its_rows():
    got = ROAD.at(np.array([-1.0, 0.5, 2.0, 9.0]))
    np.testing.assert_allclose(got, [[0, 0, 0], [1, 2, 3], [4, 6, 3], [6, 8, 0]])


def test_held_knows_only_the_past():
    got = ROAD.held(np.array([0.0, 0.99, 1.0, 2.9, 3.0, 8.0]))
    np.testing.assert_allclose(got[:, 0], [0.0, 0.0, 2.0, 2.0, 6.0, 6.0])


def test_alignment_undoes_a_turn_and_shift():
    rng = np.random.default_rng(0)
    source = rng.normal(size=(40, 3)) * 10.0
    c, s = np.cos(2.2), np.sin(2.2)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    target = source @ turn.T + (3.0, -7.0, 1.5)
    fit = align(source, target)
    assert fit.yaw == pytest.approx(2.2)
    np.testing.assert_allclose(fit.apply(source), target, atol=1e-12)


def test_alignment_is_the_least_squares_one():
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    rng = np.random.default_rng(1)
    source = np.column_stack([rng.normal(size=(60, 2)) * 20.0, np.zeros(60)])
    target = rotation.from_euler('z', -0.9).apply(source) + np.column_stack(
        [rng.normal(size=(60, 2)), np.zeros(60)])
    oracle, _ = rotation.align_vectors(target - target.mean(axis=0), source - source.mean(axis=0))
    assert align(source, target).yaw == pytest.approx(oracle.as_euler('zyx')[0], abs=1e-9)


def test_lengths_and_windows():
    error = np.array([[3.0, 4.0, 12.0], [0.0, 0.0, 5.0]])
    np.testing.assert_allclose(horizontal(error), [5.0, 0.0])
    assert rms(np.array([3.0, 4.0])) == pytest.approx(np.sqrt(12.5))
    assert np.isnan(rms(np.zeros(0)))
    np.testing.assert_array_equal(
        inside(np.array([0.9, 1.0, 1.9, 2.0, 5.5]), ((1.0, 2.0), (5.0, 6.0))),
        [False, True, True, False, True])
