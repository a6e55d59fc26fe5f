"""Rotations: quaternions [w, x, y, z] and matrices that turn body (FRD) into earth (NED) vectors.

Equations: J. Sola, "Quaternion kinematics for the error-state Kalman filter", arXiv:1711.02508.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import four
from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.kernels.compile import three

Array = NDArray[np.float64]


@kernel
def quat_multiply(p: Array, q: Array) -> Array:
    """Return the Hamilton product p q, (4,)."""
    p0, p1, p2, p3 = four(p)
    q0, q1, q2, q3 = four(q)
    return np.array((
        p0 * q0 - p1 * q1 - p2 * q2 - p3 * q3,
        p0 * q1 + p1 * q0 + p2 * q3 - p3 * q2,
        p0 * q2 - p1 * q3 + p2 * q0 + p3 * q1,
        p0 * q3 + p1 * q2 - p2 * q1 + p3 * q0,
    ))


@kernel
def quat_inverse(q: Array) -> Array:
    """Return the conjugate of a unit quaternion, (4,)."""
    return np.array((q[0], -q[1], -q[2], -q[3]))


@kernel
def quat_normalise(q: Array) -> Array:
    """Return q / |q|, (4,)."""
    q0, q1, q2, q3 = four(q)
    return q / math.sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)


@kernel
def quat_from_rotation_vector(r: Array) -> Array:
    """Return the quaternion of a rotation vector (3,) in rad; identity below 1e-10 rad."""
    r0, r1, r2 = three(r)
    return np.array(exponential(r0, r1, r2))


@kernel
def exponential(r0: float, r1: float, r2: float) -> tuple[float, float, float, float]:
    """Return the quaternion of a rotation vector in rad; identity below 1e-10 rad."""
    angle = math.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
    if angle < 1e-10:
        return 1.0, 0.0, 0.0, 0.0
    s = math.sin(0.5 * angle) / angle
    return math.cos(0.5 * angle), s * r0, s * r1, s * r2


@kernel
def rotate(p: Array, q0: float, q1: float, q2: float, q3: float) -> None:
    """Multiply p (4,) by a quaternion from the right and normalise it, in place."""
    p0, p1, p2, p3 = four(p)
    w = p0 * q0 - p1 * q1 - p2 * q2 - p3 * q3
    x = p0 * q1 + p1 * q0 + p2 * q3 - p3 * q2
    y = p0 * q2 - p1 * q3 + p2 * q0 + p3 * q1
    z = p0 * q3 + p1 * q2 - p2 * q1 + p3 * q0
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    p[0], p[1], p[2], p[3] = w / norm, x / norm, y / norm, z / norm


@kernel
def rotation_vector_from_quat(q: Array) -> Array:
    """Return the rotation vector (3,) in rad of a unit quaternion."""
    n = math.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    scale = 2.0
    if n >= 1e-10:
        scale = 2.0 * math.atan2(n, q[0]) / n
    return np.array((scale * q[1], scale * q[2], scale * q[3]))


@kernel
def matrix_from_quat(q: Array) -> Array:
    """Return the rotation matrix (3, 3) in the homogeneous form, quadratic in q."""
    rot = np.empty((3, 3))
    fill_matrix(q, rot)
    return rot


@kernel
def fill_matrix(q: Array, rot: Array) -> None:
    """Write matrix_from_quat(q) into rot (3, 3)."""
    q0, q1, q2, q3 = four(q)
    a, b, c, d = q0 * q0, q1 * q1, q2 * q2, q3 * q3
    rot[0, 0] = a + b - c - d
    rot[0, 1] = 2.0 * (q1 * q2 - q0 * q3)
    rot[0, 2] = 2.0 * (q1 * q3 + q0 * q2)
    rot[1, 0] = 2.0 * (q1 * q2 + q0 * q3)
    rot[1, 1] = a - b + c - d
    rot[1, 2] = 2.0 * (q2 * q3 - q0 * q1)
    rot[2, 0] = 2.0 * (q1 * q3 - q0 * q2)
    rot[2, 1] = 2.0 * (q2 * q3 + q0 * q1)
    rot[2, 2] = a - b - c + d


def turned(q: Array, v: Array) -> tuple[float, float, float]:
    """Return R(q) v (3,) of a unit quaternion, in floats: numpy takes longer to look at so few."""
    w, x, y, z = q.tolist()
    a, b, c = v.tolist()
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return (a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz,
            c + w * tz + x * ty - y * tx)


@kernel
def relative_rotation(p: Array, q: Array) -> Array:
    """Return the matrix (3, 3) of p q^-1: from the frame q leads to, to that of p."""
    return matrix_from_quat(quat_normalise(quat_multiply(p, quat_inverse(q))))


def quat_from_matrix(rot: Array) -> Array:
    """Return the quaternion (4,) of a rotation matrix, pivoting on the largest component.

    The pivot component is positive. (S. W. Shepperd, "Quaternion from rotation matrix", 1978.)
    """
    trace = rot[0, 0] + rot[1, 1] + rot[2, 2]
    if trace > 0.0:
        w = 0.5 * math.sqrt(1.0 + trace)
        f = 0.25 / w
        return np.array((w, (rot[2, 1] - rot[1, 2]) * f, (rot[0, 2] - rot[2, 0]) * f,
                         (rot[1, 0] - rot[0, 1]) * f))
    i = int(np.argmax(np.diag(rot)))
    j, k = (i + 1) % 3, (i + 2) % 3
    pivot = 0.5 * math.sqrt(1.0 + rot[i, i] - rot[j, j] - rot[k, k])
    f = 0.25 / pivot
    q = np.empty(4)
    q[0] = (rot[k, j] - rot[j, k]) * f
    q[1 + i] = pivot
    q[1 + j] = (rot[j, i] + rot[i, j]) * f
    q[1 + k] = (rot[k, i] + rot[i, k]) * f
    return q


def euler_321(rot: Array) -> tuple[float, float, float]:
    """Return roll, pitch, yaw in rad of R = Rz(yaw) Ry(pitch) Rx(roll)."""
    pitch = math.asin(max(-1.0, min(1.0, -rot[2, 0])))
    if abs(pitch - math.pi / 2) < 1e-3:
        return 0.0, pitch, math.atan2(rot[1, 2], rot[0, 2])
    if abs(pitch + math.pi / 2) < 1e-3:
        return 0.0, pitch, math.atan2(-rot[1, 2], -rot[0, 2])
    return (math.atan2(rot[2, 1], rot[2, 2]), pitch, math.atan2(rot[1, 0], rot[0, 0]))


def matrix_from_euler_321(roll: float, pitch: float, yaw: float) -> Array:
    """Return Rz(yaw) Ry(pitch) Rx(roll), (3, 3)."""
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return np.array((
        (cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy),
        (cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy),
        (-sp, sr * cp, cr * cp),
    ))


def matrix_from_euler_312(roll: float, pitch: float, yaw: float) -> Array:
    """Return Rz(yaw) Rx(roll) Ry(pitch), (3, 3)."""
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return np.array((
        (cy * cp - sy * sr * sp, -sy * cr, cy * sp + sy * sr * cp),
        (sy * cp + cy * sr * sp, cy * cr, sy * sp - cy * sr * cp),
        (-cr * sp, sr, cr * cp),
    ))


def rolls_more_than_pitches(rot: Array) -> bool:
    """True where the 321 sequence is farther from its singularity than the 312 one."""
    return bool(abs(rot[2, 0]) < abs(rot[2, 1]))


def yaw_321(rot: Array) -> float:
    """Return the yaw of the 321 sequence, rad."""
    return math.atan2(rot[1, 0], rot[0, 0])


def yaw_312(rot: Array) -> float:
    """Return the yaw of the 312 sequence, rad."""
    return math.atan2(-rot[0, 1], rot[1, 1])


def yaw_of(rot: Array) -> float:
    """Return the yaw of whichever sequence is farther from its singularity, rad."""
    return yaw_321(rot) if rolls_more_than_pitches(rot) else yaw_312(rot)


def with_yaw(rot: Array, yaw: float) -> Array:
    """Return a matrix (3, 3) of the same tilt and another yaw."""
    if rolls_more_than_pitches(rot):
        roll, pitch, _ = euler_321(rot)
        return matrix_from_euler_321(roll, pitch, yaw)
    roll = math.asin(max(-1.0, min(1.0, rot[2, 1])))
    pitch = math.atan2(-rot[2, 0], rot[2, 2])
    return matrix_from_euler_312(roll, pitch, yaw)


def cross(a: Array, b: Array) -> Array:
    """Return the vector product a x b, (3,); numpy's takes twenty times as long."""
    return np.array((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                     a[0] * b[1] - a[1] * b[0]))


def cross_matrix(v: Array) -> Array:
    """Return the matrix [v x], (3, 3)."""
    return np.array(((0.0, -v[2], v[1]), (v[2], 0.0, -v[0]), (-v[1], v[0], 0.0)))
