"""Rigid transforms: a position and a unit quaternion [w, x, y, z]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import quat_from_rotation_vector
from ekf_fusion_ros.mathlib.rotation import quat_inverse
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.mathlib.rotation import quat_normalise
from ekf_fusion_ros.mathlib.rotation import rotation_vector_from_quat

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Where a child frame is in its parent: p_parent = position + R(quaternion) p_child, m."""

    position: Array
    quaternion: Array


def compose(first: Pose, second: Pose) -> Pose:
    """Return a -> c of a -> b and b -> c."""
    turned = matrix_from_quat(first.quaternion) @ second.position
    return Pose(first.position + turned,
                quat_normalise(quat_multiply(first.quaternion, second.quaternion)))


def inverse(pose: Pose) -> Pose:
    """Return b -> a of a -> b."""
    back = quat_inverse(pose.quaternion)
    return Pose(-(matrix_from_quat(back) @ pose.position), back)


def interpolate(first: Pose, second: Pose, share: float) -> Pose:
    """Return the pose at a share of the way, 0 = first, 1 = second.

    Position goes along the line, attitude at a constant rate the shorter way round, as tf2 does.
    """
    turn = quat_multiply(quat_inverse(first.quaternion), second.quaternion)
    if turn[0] < 0.0:
        turn = -turn
    part = quat_from_rotation_vector(share * rotation_vector_from_quat(turn))
    return Pose(first.position + share * (second.position - first.position),
                quat_normalise(quat_multiply(first.quaternion, part)))
