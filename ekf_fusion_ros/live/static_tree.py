"""Frames that are tied to each other for good, as /tf_static tells."""

from __future__ import annotations

from collections import deque

import numpy as np

from ekf_fusion_ros.mathlib.rigid import Pose
from ekf_fusion_ros.mathlib.rigid import compose
from ekf_fusion_ros.mathlib.rigid import inverse


class StaticTree:
    """Fixed poses of child frames in their parents; asks go along any path, up and down."""

    def __init__(self) -> None:
        self._neighbours: dict[str, dict[str, Pose]] = {}

    def add(self, parent: str, child: str, pose: Pose) -> None:
        """Take the pose of a child in its parent, instead of an earlier one."""
        self._neighbours.setdefault(parent, {})[child] = pose
        self._neighbours.setdefault(child, {})[parent] = inverse(pose)

    def pose(self, parent: str, child: str) -> Pose | None:
        """Return where a frame is in another, None where nothing ties them."""
        found = {parent: Pose(np.zeros(3), np.array((1.0, 0.0, 0.0, 0.0)))}
        waiting = deque([parent])
        while waiting and child not in found:
            frame = waiting.popleft()
            for other, step in self._neighbours.get(frame, {}).items():
                if other not in found:
                    found[other] = compose(found[frame], step)
                    waiting.append(other)
        return found.get(child)
