"""What tests compare with: quaternions by definition, numeric derivatives, drawn states."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import strategies as st
import numpy as np

Array = np.ndarray


def hamilton(p: Array, q: Array) -> Array:
    """Return the quaternion product by the matrix of multiplication from the left."""
    w, x, y, z = p
    return np.array(((w, -x, -y, -z), (x, w, -z, y), (y, z, w, -x), (z, -y, x, w))) @ q


def conjugate(q: Array) -> Array:
    return q * np.array((1.0, -1.0, -1.0, -1.0))


def sandwich(q: Array, v: Array) -> Array:
    """Return the vector part of q v q*, which for a unit quaternion is R(q) v."""
    return hamilton(hamilton(q, np.concatenate([[0.0], v])), conjugate(q))[1:4]


def difference(function: Callable[[Array], Array], x: Array, step: float = 1e-5) -> Array:
    """Return the Jacobian (outputs, inputs) by central differences."""
    columns = []
    for i in range(len(x)):
        ahead, behind = x.copy(), x.copy()
        ahead[i] += step
        behind[i] -= step
        columns.append((np.atleast_1d(function(ahead)) - np.atleast_1d(function(behind)))
                       / (2.0 * step))
    return np.stack(columns, axis=1)


def to_scipy(q: Array) -> Array:
    return np.roll(q, -1)


def from_scipy(q: Array) -> Array:
    return np.roll(q, 1)


def vectors(size: int, limit: float) -> st.SearchStrategy[Array]:
    """Draw arrays with components within +-limit."""
    component = st.floats(-limit, limit, allow_subnormal=False)
    return st.lists(component, min_size=size, max_size=size).map(np.array)


def quaternions() -> st.SearchStrategy[Array]:
    """Draw unit quaternions of either sign."""
    return (vectors(4, 1.0).filter(lambda q: np.linalg.norm(q) > 0.1)
            .map(lambda q: q / np.linalg.norm(q)))


SCALES = np.repeat((0.02, 0.5, 1.0, 1e-3, 2e-3, 0.05, 0.05, 0.5), (4, 3, 3, 3, 3, 3, 3, 2))


def covariance(seed: int, scales: Array = SCALES) -> Array:
    """Return a full positive definite matrix with standard deviations of the order of scales."""
    root = np.random.default_rng(seed).normal(size=(len(scales), 2 * len(scales)))
    p = np.corrcoef(root)
    return p * np.outer(scales, scales)


def seeds() -> st.SearchStrategy[int]:
    return st.integers(0, 2 ** 32 - 1)
