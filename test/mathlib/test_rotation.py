"""Rotations against scipy."""

from __future__ import annotations

import math

from hypothesis import assume
from hypothesis import given
from hypothesis import settings
from hypothesis import strategies as st
import numpy as np
from oracles import from_scipy
from oracles import quaternions
from oracles import to_scipy
from oracles import vectors
import pytest

from ekf_fusion_ros.mathlib.rotation import cross_matrix
from ekf_fusion_ros.mathlib.rotation import euler_321
from ekf_fusion_ros.mathlib.rotation import matrix_from_euler_312
from ekf_fusion_ros.mathlib.rotation import matrix_from_euler_321
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import quat_from_matrix
from ekf_fusion_ros.mathlib.rotation import quat_from_rotation_vector
from ekf_fusion_ros.mathlib.rotation import quat_inverse
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.mathlib.rotation import quat_normalise
from ekf_fusion_ros.mathlib.rotation import rolls_more_than_pitches
from ekf_fusion_ros.mathlib.rotation import rotation_vector_from_quat
from ekf_fusion_ros.mathlib.rotation import turned
from ekf_fusion_ros.mathlib.rotation import with_yaw
from ekf_fusion_ros.mathlib.rotation import yaw_312
from ekf_fusion_ros.mathlib.rotation import yaw_321
from ekf_fusion_ros.mathlib.rotation import yaw_of

Rotation = pytest.importorskip('scipy.spatial.transform').Rotation

MANY = settings(deadline=None, max_examples=60)
TILT = st.floats(-1.5, 1.5)
TURN = st.floats(-math.pi, math.pi)


def scipy_rotation(q):
    return Rotation.from_quat(to_scipy(q))


@MANY
@given(p=quaternions(), q=quaternions())
def test_product_and_inverse(p, q):
    product = scipy_rotation(quat_multiply(p, quat_inverse(q)))
    expected = scipy_rotation(p) * scipy_rotation(q).inv()
    np.testing.assert_allclose(product.as_matrix(), expected.as_matrix(), atol=1e-12)


@MANY
@given(q=quaternions(), size=st.floats(0.1, 10.0))
def test_normalised(q, size):
    np.testing.assert_allclose(quat_normalise(q * size), q, atol=1e-14)


@MANY
@given(q=quaternions(), v=vectors(3, 5.0))
def test_matrix_turns_body_into_earth(q, v):
    np.testing.assert_allclose(matrix_from_quat(q) @ v, scipy_rotation(q).apply(v), atol=1e-12)
    np.testing.assert_allclose(turned(q, v), scipy_rotation(q).apply(v), atol=1e-12)


@MANY
@given(q=quaternions())
def test_quaternion_of_a_matrix_pivots_on_a_positive_component(q):
    found = quat_from_matrix(scipy_rotation(q).as_matrix())
    assert abs(found @ q) == pytest.approx(1.0)
    if scipy_rotation(q).as_matrix().trace() > 0.0:
        assert found[0] > 0.0
    else:
        # two may be as large
        largest = np.abs(found[1:4]) > np.abs(found[1:4]).max() - 1e-9
        assert found[1:4][largest].max() > 0.0


@pytest.mark.parametrize('axis', range(3))
def test_quaternion_of_half_a_turn(axis):
    matrix = Rotation.from_rotvec(math.pi * np.eye(3)[axis]).as_matrix()
    np.testing.assert_allclose(quat_from_matrix(matrix), np.eye(4)[1 + axis], atol=1e-12)


@MANY
@given(r=vectors(3, 1.7))
def test_rotation_vectors(r):
    q = quat_from_rotation_vector(r)
    expected = from_scipy(Rotation.from_rotvec(r).as_quat())
    assert abs(q @ expected) == pytest.approx(1.0)
    np.testing.assert_allclose(rotation_vector_from_quat(q), r, atol=1e-9)


def test_tiny_rotation_vectors():
    np.testing.assert_array_equal(quat_from_rotation_vector(np.full(3, 1e-12)), (1, 0, 0, 0))
    small = np.array((3e-9, -2e-9, 1e-9))
    q = quat_from_rotation_vector(small)
    np.testing.assert_allclose(q[1:4], 0.5 * small, rtol=1e-12)
    np.testing.assert_allclose(rotation_vector_from_quat(q), small, rtol=1e-9)


@MANY
@given(roll=TURN, pitch=TILT, yaw=TURN)
def test_euler_321(roll, pitch, yaw):
    expected = Rotation.from_euler('ZYX', (yaw, pitch, roll))
    np.testing.assert_allclose(matrix_from_euler_321(roll, pitch, yaw), expected.as_matrix(),
                               atol=1e-12)
    angles = euler_321(expected.as_matrix())
    error = angles - expected.as_euler('ZYX')[::-1]
    # half a turn has two names
    np.testing.assert_allclose((error + math.pi) % (2.0 * math.pi), math.pi, atol=1e-6)


@pytest.mark.parametrize('pitch', [0.5 * math.pi, -0.5 * math.pi])
def test_euler_321_looking_up_or_down(pitch):
    matrix = Rotation.from_euler('ZYX', (0.7, pitch, 0.0)).as_matrix()
    roll, found, yaw = euler_321(matrix)
    np.testing.assert_allclose(matrix_from_euler_321(roll, found, yaw), matrix, atol=1e-6)
    assert roll == 0.0


@MANY
@given(roll=TILT, pitch=TURN, yaw=TURN)
def test_euler_312(roll, pitch, yaw):
    expected = Rotation.from_euler('ZXY', (yaw, roll, pitch)).as_matrix()
    np.testing.assert_allclose(matrix_from_euler_312(roll, pitch, yaw), expected, atol=1e-12)
    assert math.cos(yaw_312(expected) - yaw) == pytest.approx(1.0)


@MANY
@given(q=quaternions(), yaw=TURN)
def test_another_yaw_keeps_the_tilt(q, yaw):
    rot = scipy_rotation(q).as_matrix()
    assume(np.hypot(rot[2, 0], rot[2, 1]) < 0.999)
    turned = with_yaw(rot, yaw)
    np.testing.assert_allclose(turned[2], rot[2], atol=1e-6)
    np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-9)
    sequence = 'ZYX' if rolls_more_than_pitches(rot) else 'ZXY'
    found = Rotation.from_matrix(turned).as_euler(sequence)[0]
    assert math.cos(found - yaw) == pytest.approx(1.0)


@pytest.mark.parametrize(('roll', 'pitch', 'sequence'), [
    (0.6, 0.1, yaw_321), (0.1, 0.6, yaw_312), (1.5, 0.2, yaw_321), (0.2, 1.5, yaw_312),
    (0.5 * math.pi, 0.0, yaw_321), (0.0, 0.5 * math.pi, yaw_312)])
def test_yaw_is_read_far_from_the_singularity(roll, pitch, sequence):
    rot = Rotation.from_euler('ZYX', (0.4, pitch, roll)).as_matrix()
    assert yaw_of(rot) == sequence(rot)


@MANY
@given(a=vectors(3, 5.0), b=vectors(3, 5.0))
def test_cross_matrix(a, b):
    np.testing.assert_allclose(cross_matrix(a) @ b, np.cross(a, b), atol=1e-12)
