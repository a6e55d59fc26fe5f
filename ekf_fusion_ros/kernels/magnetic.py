"""Magnetic field in body axes: prediction, Jacobian and the update of one axis.

h = R(q)' m_earth + m_body with R quadratic in q; with v the vector part of q,
    R' m = (q0^2 - v.v) m + 2 v (v.m) - 2 q0 v x m   (Sola 2017, eq. 115, transposed).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.kernels.innovation import project
from ekf_fusion_ros.kernels.update import WIND_ACTIVE
from ekf_fusion_ros.kernels.update import apply_update
from ekf_fusion_ros.kernels.update import test_ratio

Array = NDArray[np.float64]
Three = tuple[float, float, float]

DECLINATION_SPREAD = 0.5
"""Largest deviation in rad of the field's direction from the declination."""

VANISHED = 1e-3
"""Share of the shortest field below which its direction means nothing."""


@kernel
def low_pass(value: Array, measured: Array, share: float) -> None:
    """Move value (n,) by a share of its distance towards measured (n,), in place."""
    for i in range(value.shape[0]):
        value[i] = (1.0 - share) * value[i] + share * measured[i]


@kernel
def field_jacobian(x: Array, axis: int, h: Array) -> float:
    """Fill h (24,) with the gradient of one body axis and return its prediction, Gauss."""
    q0, v0, v1, v2 = x[0], x[1], x[2], x[3]
    m = x[16:19]
    vm = v0 * m[0] + v1 * m[1] + v2 * m[2]
    j = (axis + 1) % 3
    k = (axis + 2) % 3
    v = x[1:4]
    cross = v[j] * m[k] - v[k] * m[j]
    vv = v0 * v0 + v1 * v1 + v2 * v2
    h[:] = 0.0
    h[0] = 2.0 * (q0 * m[axis] - cross)
    h[1 + axis] = 2.0 * vm
    for i in range(3):
        h[1 + i] += 2.0 * (v[axis] * m[i] - m[axis] * v[i])
        h[16 + i] = 2.0 * v[axis] * v[i]
    h[16 + axis] += q0 * q0 - vv
    # 2 q0 [m x] v, row `axis`: m_j v_k - m_k v_j
    h[1 + k] += 2.0 * q0 * m[j]
    h[1 + j] -= 2.0 * q0 * m[k]
    # -2 q0 (v x m), row `axis`: v_j m_k - v_k m_j
    h[16 + k] -= 2.0 * q0 * v[j]
    h[16 + j] += 2.0 * q0 * v[k]
    h[19 + axis] = 1.0
    rotated = (q0 * q0 - vv) * m[axis] + 2.0 * v[axis] * vm - 2.0 * q0 * cross
    return float(rotated + x[19 + axis])


@kernel
def fuse_field_axis(
    x: Array, p: Array, axis: int, innovation: float, noise: float, all_states: bool,
    limits: Array, variance: Array,
) -> int:
    """Fuse one axis; 0 = done, 1 = innovation variance below the noise, 2 = P unhealthy.

    The Jacobian is taken at the present x. Unless all_states, only the field states are corrected.
    """
    h, hp = np.empty(24), np.empty(24)
    field_jacobian(x, axis, h)
    s = project(p, h, hp) + noise
    if s < noise:
        return 1
    variance[axis] = s
    gain = hp / s
    for k in range(3):
        if limits[k] != 0.0:
            gain[13 + k] = 0.0
    if not all_states:
        gain[0:16] = 0.0
        gain[22:24] = 0.0
    if limits[WIND_ACTIVE] == 0.0:
        gain[22:24] = 0.0
    if apply_update(p, x, gain, hp, innovation, limits):
        return 0
    return 2


@kernel
def limit_field(x: Array, declination: float, shortest: float) -> None:
    """Keep the horizontal earth field (Gauss) long enough and within 0.5 rad of a declination."""
    north, east = x[16], x[17]
    length = math.hypot(north, east)
    if length < shortest:
        if length <= VANISHED * shortest:
            x[16] = 2.0 * shortest * math.cos(declination)
            x[17] = 2.0 * shortest * math.sin(declination)
            return
        north *= shortest / length
        east *= shortest / length
        length = shortest
        x[16], x[17] = north, east
    angle = math.atan2(east, north)
    wanted = min(max(angle, declination - DECLINATION_SPREAD), declination + DECLINATION_SPREAD)
    if wanted != angle:
        x[16], x[17] = length * math.cos(wanted), length * math.sin(wanted)


@kernel
def fuse_field(
    x: Array, p: Array, innovation: Array, axes: int, noise: float, all_states: bool,
    declination: float, shortest: float, limits: Array, variance: Array,
) -> tuple[int, int, int]:
    """Fuse the first axes one after the other, each with the Jacobian at the newest state.

    Returns what fuse_field_axis said of each; an innovation variance below the noise ends the
    sequence.
    """
    outcome = np.zeros(3, np.int64)
    for axis in range(axes):
        outcome[axis] = fuse_field_axis(
            x, p, axis, innovation[axis], noise, all_states, limits, variance)
        if outcome[axis] == 1:
            break
        if outcome[axis] == 0:
            limit_field(x, declination, shortest)
    return outcome[0], outcome[1], outcome[2]


@kernel
def correct_by_field(
    x: Array, p: Array, measured: Array, axes: int, noise: float, gate: float, all_states: bool,
    declination: float, shortest: float, limits: Array,
) -> tuple[bool, Three, Three, Three, tuple[int, int, int]]:
    """Gate measured (3,) in Gauss and fuse its first axes together, or none of them.

    Returns whether it could be judged (no innovation variance below the noise), innovations in
    Gauss, their variances in Gauss^2, test ratios, and what fuse_field_axis said of each axis.
    """
    innovation, h, hp = np.zeros(3), np.empty(24), np.empty(24)
    variance, ratio = np.empty(3), np.zeros(3)
    fit, passes, first, second, third = True, True, 0, 0, 0
    for axis in range(3):
        value = field_jacobian(x, axis, h) - measured[axis]
        variance[axis] = project(p, h, hp) + noise
        fit = fit and variance[axis] >= noise
        if axis < axes:
            innovation[axis] = value
            ratio[axis] = test_ratio(value, variance[axis], gate)
            passes = passes and ratio[axis] <= 1.0
    if not fit:
        first, second, third = variance[0] < noise, variance[1] < noise, variance[2] < noise
    elif passes:
        first, second, third = fuse_field(
            x, p, innovation, axes, noise, all_states, declination, shortest, limits, variance)
    return (fit, (innovation[0], innovation[1], innovation[2]),
            (variance[0], variance[1], variance[2]), (ratio[0], ratio[1], ratio[2]),
            (first, second, third))


@kernel
def fuse_declination(
    x: Array, p: Array, wanted: float, noise: float, declination: float, shortest: float,
    limits: Array,
) -> tuple[float, float, int]:
    """Fuse a wanted declination in rad with a noise variance in rad^2, in place; see limit_field.

    Returns the innovation, clipped to DECLINATION_SPREAD, its variance, and 0 = done, 1 = variance
    not above the noise, 2 = P unhealthy.
    """
    hp, gain = np.empty(24), np.empty(24)
    variance = observe_declination(x, p, hp, gain) + noise
    innovation = math.atan2(x[17], x[16]) - wanted
    innovation = min(max(innovation, -DECLINATION_SPREAD), DECLINATION_SPREAD)
    if variance <= noise:
        return innovation, variance, 1
    for i in range(24):
        gain[i] /= variance
    for k in range(3):
        if limits[k] != 0.0:
            gain[13 + k] = 0.0
    healthy = apply_update(p, x, gain, hp, innovation, limits)
    limit_field(x, declination, shortest)
    return innovation, variance, 0 if healthy else 2


@kernel
def observe_declination(x: Array, p: Array, hp: Array, gain: Array) -> float:
    """Fill H P and P H' (24,) of atan2(east, north) of the earth field; return H P H', rad^2."""
    north, east = x[16], x[17]
    square = north * north + east * east
    h_north, h_east = -east / square, north / square
    for i in range(24):
        hp[i] = h_north * p[16, i] + h_east * p[17, i]
        gain[i] = h_north * p[i, 16] + h_east * p[i, 17]
    return float(h_north * gain[16] + h_east * gain[17])
