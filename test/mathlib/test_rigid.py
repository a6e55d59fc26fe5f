"""Rigid transforms against homogeneous matrices and scipy's spherical interpolation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
import pytest

from ekf_fusion_ros.mathlib.rigid import Pose
from ekf_fusion_ros.mathlib.rigid import compose
from ekf_fusion_ros.mathlib.rigid import interpolate
from ekf_fusion_ros.mathlib.rigid import inverse

spatial = pytest.importorskip('scipy.spatial.transform')


def random_pose(seed: int) -> Pose:
    rng = np.random.default_rng(seed)
    quaternion = rng.normal(size=4)
    return Pose(rng.normal(scale=50.0, size=3), quaternion / np.linalg.norm(quaternion))


def rotation(pose: Pose) -> spatial.Rotation:
    return spatial.Rotation.from_quat(np.roll(pose.quaternion, -1))


def matrix(pose: Pose) -> NDArray[np.float64]:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = rotation(pose).as_matrix(), pose.position
    return made


@pytest.mark.parametrize('seed', range(5))
def test_compose_and_inverse_are_those_of_matrices(seed: int) -> None:
    first, second = random_pose(seed), random_pose(seed + 100)
    np.testing.assert_allclose(
        matrix(compose(first, second)), matrix(first) @ matrix(second), atol=1e-12)
    np.testing.assert_allclose(matrix(inverse(first)), np.linalg.inv(matrix(first)), atol=1e-12)


@pytest.mark.parametrize('seed', range(5))
@pytest.mark.parametrize('share', [0.0, 0.3, 1.0])
def test_interpolation_is_linear_and_spherical(seed: int, share: float) -> None:
    first, second = random_pose(seed), random_pose(seed + 100)
    middle = interpolate(first, second, share)
    np.testing.assert_allclose(
        middle.position, (1.0 - share) * first.position + share * second.position, atol=1e-12)
    ends = spatial.Rotation.concatenate([rotation(first), rotation(second)])
    wanted = spatial.Slerp([0.0, 1.0], ends)(share)
    assert (wanted.inv() * rotation(middle)).magnitude() < 1e-9


def test_a_quaternion_and_its_negative_are_the_same_attitude() -> None:
    first = random_pose(1)
    second = Pose(first.position, -first.quaternion)
    middle = interpolate(first, second, 0.5)
    assert abs(abs(middle.quaternion @ first.quaternion) - 1.0) < 1e-12
