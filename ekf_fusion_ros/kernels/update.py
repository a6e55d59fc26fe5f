"""Covariance limits and the scalar measurement update.

Sequential scalar updates (e.g. D. Simon, "Optimal State Estimation", 2006, section 6.1):
    S = H P H' + R,  K = P H' / S,  P <- P - K H P,  x <- x - K (predicted - measured).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.kernels.compile import COMPILED
from ekf_fusion_ros.kernels.compile import kernel
from ekf_fusion_ros.mathlib.rotation import rotate

Array = NDArray[np.float64]

MAG_ACTIVE = 3
WIND_ACTIVE = 4
ACCEL_BIAS_VARIANCE_MAX = 5
"""Entries of `limits` (6,) behind the three that mark accelerometer axes whose bias is frozen: 1
while the field and the wind states are estimated, and the largest variance of an accelerometer
bias in (m/s)^2 per period."""

VARIANCE_MIN = np.array([0.0] * 4 + [1e-6] * 6 + [0.0] * 3)
VARIANCE_MAX = np.array([1.0] * 4 + [1e6] * 6 + [1.0] * 3)
FIELD_VARIANCE_MAX = 1.0
WIND_VARIANCE_MAX = 1e6
ACCEL_BIAS_VARIANCE_FLOOR = 5e-8
ACCEL_BIAS_VARIANCE_SAFE = 1e-9


@kernel
def _subtract_by_element(p: Array, gain: Array, hp: Array) -> bool:
    for i in range(24):
        if p[i, i] < gain[i] * hp[i]:
            return False
    for i in range(24):
        half_gain, half_hp = 0.5 * gain[i], 0.5 * hp[i]
        for j in range(i + 1):
            p[i, j] = p[j, i] = p[i, j] - (half_gain * hp[j] + half_hp * gain[j])
    return True


def _subtract_as_arrays(p: Array, gain: Array, hp: Array) -> bool:
    if (p.ravel()[::25] < gain * hp).any():
        return False
    half = np.multiply.outer(0.5 * gain, hp)
    p -= half + half.T
    return True


subtract = _subtract_by_element if COMPILED else _subtract_as_arrays
"""P <- P - K H P with the halves averaged, for gain (24,) and H P (24,); False, and nothing done,
where a variance would turn negative. P is and stays symmetric, to the last bit."""


@kernel
def _move_by_element(x: Array, gain: Array, innovation: float) -> None:
    for i in range(24):
        x[i] -= gain[i] * innovation
    rotate(x, 1.0, 0.0, 0.0, 0.0)


def _move_as_arrays(x: Array, gain: Array, innovation: float) -> None:
    x -= gain * innovation
    rotate(x, 1.0, 0.0, 0.0, 0.0)


move = _move_by_element if COMPILED else _move_as_arrays
"""x <- x - K times the innovation, with the quaternion normalised."""


@kernel
def limit_covariance(p: Array, limits: Array) -> None:
    """Clamp the variances of a symmetric P and keep inactive blocks at zero, in place.

    The accelerometer-bias variances are kept within a ratio of 100; one that has collapsed
    decorrelates all three.
    """
    for k in range(13):
        p[k, k] = min(max(p[k, k], VARIANCE_MIN[k]), VARIANCE_MAX[k])
    limit_accel_biases(p, limits)
    limit_block(p, 16, 22, limits[MAG_ACTIVE] != 0.0, FIELD_VARIANCE_MAX)
    limit_block(p, 22, 24, limits[WIND_ACTIVE] != 0.0, WIND_VARIANCE_MAX)


@kernel
def limit_block(p: Array, first: int, last: int, active: bool, largest: float) -> None:
    """Clamp the variances of states in use; states that are not have no covariance."""
    for k in range(first, last):
        variance = p[k, k]
        if active:
            p[k, k] = min(max(variance, 0.0), largest)
        elif variance != 0.0:
            p[k, :] = 0.0
            p[:, k] = 0.0


@kernel
def limit_accel_biases(p: Array, limits: Array) -> None:
    """Keep the variances of the biases that are learned above the floor and near each other."""
    largest = ACCEL_BIAS_VARIANCE_SAFE
    collapsed = False
    free = 0
    for k in range(3):
        if limits[k] == 0.0:
            free += 1
            variance = p[13 + k, 13 + k]
            if variance > largest:
                largest = variance
            elif variance < ACCEL_BIAS_VARIANCE_SAFE:
                collapsed = True
    if free == 0:
        return
    lower = max(0.01 * largest, ACCEL_BIAS_VARIANCE_FLOOR)
    for k in range(3):
        if limits[k] == 0.0:
            p[13 + k, 13 + k] = min(max(p[13 + k, 13 + k], lower), limits[ACCEL_BIAS_VARIANCE_MAX])
    if collapsed:
        for k in range(13, 16):
            variance = p[k, k]
            p[k, :] = 0.0
            p[:, k] = 0.0
            p[k, k] = variance


@kernel
def apply_update(
    p: Array, x: Array, gain: Array, hp: Array, innovation: float, limits: Array,
) -> bool:
    """Subtract gain x hp from P and gain x innovation from x; False if P would turn negative.

    gain (24,) may have been cut by the caller; hp (24,) = H P. On failure the rows of the states
    that would turn negative are zeroed and nothing else is changed.
    """
    if not subtract(p, gain, hp):
        for i in range(24):
            if p[i, i] < gain[i] * hp[i]:
                p[i, :] = 0.0
                p[:, i] = 0.0
        return False
    limit_covariance(p, limits)
    move(x, gain, innovation)
    return True


@kernel
def apply_direct(
    p: Array, x: Array, state: int, variance: float, innovation: float, limits: Array,
) -> bool:
    """Update with an observation of one state whose innovation variance is given."""
    hp = p[state].copy()
    return apply_update(p, x, hp / variance, hp, innovation, limits)


@kernel
def test_ratio(innovation: float, variance: float, gate: float) -> float:
    """Return innovation^2 / (gate^2 variance), the test ratio; the gate is at least one sigma."""
    gate = max(gate, 1.0)
    return innovation * innovation / (gate * gate * variance)


@kernel
def fuse_state(
    p: Array, x: Array, state: int, innovation: float, noise: float, gate: float, limits: Array,
) -> tuple[float, float, bool]:
    """Observe one state: fuse it where the test ratio is at most 1.

    innovation (predicted minus measured) and noise variance in the units of the state. Returns
    the innovation variance, the test ratio, and False where the update was unhealthy.
    """
    variance = p[state, state] + noise
    ratio = test_ratio(innovation, variance, gate)
    healthy = True
    if ratio <= 1.0:
        healthy = apply_direct(p, x, state, variance, innovation, limits)
    return variance, ratio, healthy


@kernel
def fuse_two_states(
    p: Array, x: Array, first: int, innovation_a: float, innovation_b: float, noise_a: float,
    noise_b: float, gate: float, largest_ratio: float, limits: Array,
) -> tuple[float, float, float, int]:
    """Observe two neighbouring states: fuse both where no test ratio is above the largest.

    Innovations and their variances are those from before the first. Returns both variances, the
    larger ratio, and a word whose bit i tells that the update of observation i was unhealthy.
    """
    variance_a = p[first, first] + noise_a
    variance_b = p[first + 1, first + 1] + noise_b
    ratio = max(test_ratio(innovation_a, variance_a, gate),
                test_ratio(innovation_b, variance_b, gate))
    faults = 0
    if ratio <= largest_ratio:
        if not apply_direct(p, x, first, variance_a, innovation_a, limits):
            faults += 1
        if not apply_direct(p, x, first + 1, variance_b, innovation_b, limits):
            faults += 2
    return variance_a, variance_b, ratio, faults
