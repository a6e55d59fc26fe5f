"""Velocity observed in the body frame."""

from __future__ import annotations

from hypothesis import given
from hypothesis import settings
from hypothesis import strategies as st
import numpy as np
import pytest

from ekf_fusion_ros.ekf2.aid_sources.vision_body_velocity import body_velocity_jacobian
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat

components = st.floats(-1.0, 1.0)
speeds = st.floats(-30.0, 30.0)


@settings(max_examples=50)
@given(st.tuples(components, components, components, components).filter(
    lambda q: np.linalg.norm(q) > 0.1), st.tuples(speeds, speeds, speeds))
def test_jacobian_by_the_quaternion_agrees_with_differences(q, velocity):
    q, velocity = np.array(q) / np.linalg.norm(q), np.array(velocity)
    numeric = np.empty((3, 4))
    step = 1e-6
    for i in range(4):
        shift = step * np.eye(4)[i]
        above = matrix_from_quat(q + shift).T @ velocity
        below = matrix_from_quat(q - shift).T @ velocity
        numeric[:, i] = (above - below) / (2 * step)
    assert body_velocity_jacobian(q, velocity) == pytest.approx(numeric, abs=1e-6)
