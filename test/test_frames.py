"""Frame conversions against MAVROS's published relations, worked by hand, and scipy."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from ekf_fusion_ros import frames

# Roll, pitch, yaw of MAVROS's static transforms map -> map_ned and base_link -> base_link_frd.
PARENT_RPY = (math.pi, 0.0, math.pi / 2)
CHILD_RPY = (math.pi, 0.0, 0.0)

unit = st.floats(-1.0, 1.0)
quaternions = st.tuples(unit, unit, unit, unit).filter(
    lambda q: np.linalg.norm(q) > 0.1).map(lambda q: np.array(q) / np.linalg.norm(q))


def rotations(*rpy_list):
    scipy = pytest.importorskip('scipy.spatial.transform')
    return [scipy.Rotation.from_euler('xyz', rpy) for rpy in rpy_list]


def scipy_rotation(quaternion):
    scipy = pytest.importorskip('scipy.spatial.transform')
    return scipy.Rotation.from_quat(np.roll(quaternion, -1))


def same_rotation(q, rotation):
    """Quaternions of either sign are one rotation."""
    return abs(float(np.dot(np.roll(q, -1), rotation.as_quat()))) == pytest.approx(1.0, abs=1e-14)


def test_vectors_by_hand():
    assert frames.swap_enu_ned(np.array((1.0, 2.0, 3.0))).tolist() == [2.0, 1.0, -3.0]
    assert frames.swap_flu_frd(np.array((1.0, 2.0, 3.0))).tolist() == [1.0, -2.0, -3.0]


def test_constants_are_mavros_static_transforms():
    parent, child = rotations(PARENT_RPY, CHILD_RPY)
    assert frames.NED_ENU == pytest.approx(parent.as_matrix(), abs=1e-15)
    assert frames.FRD_FLU == pytest.approx(child.as_matrix(), abs=1e-15)


@pytest.mark.parametrize(('enu_flu', 'ned_frd'), [
    # Nose to the east: yaw 0 in ENU, 90 deg in NED.
    ((1.0, 0.0, 0.0, 0.0), (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))),
    # Nose to the north: yaw 90 deg in ENU, 0 in NED.
    ((math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)), (1.0, 0.0, 0.0, 0.0)),
    # Nose north, right wing down 60 deg: the same roll about the nose in both.
    ((math.sqrt(0.375), math.sqrt(0.125), math.sqrt(0.125), math.sqrt(0.375)),
     (math.sqrt(0.75), 0.5, 0.0, 0.0)),
])
def test_attitudes_by_hand(enu_flu, ned_frd):
    assert frames.swap_attitude(np.array(enu_flu)) == pytest.approx(ned_frd, abs=1e-15)


@given(quaternions)
def test_attitude_is_mavros_product(q):
    parent, child = rotations(PARENT_RPY, CHILD_RPY)
    body = scipy_rotation(q)
    assert same_rotation(frames.swap_attitude(q), parent * body * child.inv())
    assert same_rotation(frames.swap_attitude_parent(q), parent * body)
    assert same_rotation(frames.swap_attitude_child(q), body * child.inv())


@given(quaternions)
def test_conversions_undo_themselves(q):
    for swap in (frames.swap_attitude, frames.swap_attitude_parent, frames.swap_attitude_child):
        assert abs(float(np.dot(swap(swap(q)), q))) == pytest.approx(1.0, abs=1e-14)
    assert frames.swap_enu_ned(frames.swap_enu_ned(q[1:])).tolist() == q[1:].tolist()
    assert frames.swap_flu_frd(frames.swap_flu_frd(q[1:])).tolist() == q[1:].tolist()


@given(quaternions, st.tuples(unit, unit, unit))
def test_a_body_vector_is_the_same_arrow_in_both_worlds(q, vector):
    in_enu = scipy_rotation(q).apply(vector)
    in_ned = scipy_rotation(frames.swap_attitude(q)).apply(frames.swap_flu_frd(np.array(vector)))
    assert in_ned == pytest.approx(frames.swap_enu_ned(in_enu), abs=1e-14)


@given(st.floats(-20.0, 20.0))
def test_yaw_is_the_attitudes_yaw(yaw):
    q = np.array((math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)))
    w, _, _, z = frames.swap_attitude(q)
    got = frames.swap_yaw_enu_ned(yaw)
    assert -math.pi <= got < math.pi
    assert math.cos(got - 2 * math.atan2(z, w)) == pytest.approx(1.0, abs=1e-12)
    assert math.cos(frames.swap_yaw_enu_ned(got) - yaw) == pytest.approx(1.0, abs=1e-12)


def test_pose_covariance_by_hand():
    covariance = np.diag((1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    covariance[0, 2] = covariance[2, 0] = 0.5
    covariance[1, 5] = covariance[5, 1] = -0.25
    turned = frames.rotate_covariance(covariance, frames.NED_ENU)
    assert np.diag(turned).tolist() == [2.0, 1.0, 3.0, 5.0, 4.0, 6.0]
    assert turned[1, 2] == -0.5
    assert turned[0, 5] == 0.25


def test_twist_covariance_by_hand():
    covariance = np.diag((1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    covariance[0, 1] = covariance[1, 0] = 0.5
    covariance[1, 2] = covariance[2, 1] = 0.125
    turned = frames.rotate_covariance(covariance, frames.FRD_FLU)
    assert np.diag(turned).tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert turned[0, 1] == -0.5
    assert turned[1, 2] == 0.125


@given(st.integers(0, 2**32 - 1))
def test_covariance_is_the_block_diagonal_product(seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(6, 6))
    covariance = root @ root.T
    rotation, = rotations(rng.uniform(-3, 3, 3))
    block = np.kron(np.eye(2), rotation.as_matrix())
    assert frames.rotate_covariance(covariance, rotation.as_matrix()) == pytest.approx(
        block @ covariance @ block.T, abs=1e-12)
    assert frames.rotate_covariance(covariance[:3, :3], rotation.as_matrix()) == pytest.approx(
        (block @ covariance @ block.T)[:3, :3], abs=1e-12)


@pytest.mark.parametrize(('name', 'kind'), [
    ('odom_ned', 'ned'), ('base_link_frd', 'frd'), ('map_frd', 'frd'), ('odom', 'enu'),
    ('', 'enu'), ('ned', 'enu'), ('ned_odom', 'enu'), ('camera_init', 'enu'), ('odom_NED', 'enu'),
])
def test_frame_names(name, kind):
    assert frames.frame_kind(name) == kind
