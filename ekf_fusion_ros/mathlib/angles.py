"""Angles."""

from __future__ import annotations

import math


def wrap_pi(angle: float) -> float:
    """Return the angle in rad within [-pi, pi)."""
    if -math.pi <= angle < math.pi:
        return angle
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))
