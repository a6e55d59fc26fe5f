"""Where the odometry frame lies in the map: the fused pose against the odometry's own."""

from __future__ import annotations

from collections import deque

from ekf_fusion_ros.mathlib.rigid import Pose
from ekf_fusion_ros.mathlib.rigid import compose
from ekf_fusion_ros.mathlib.rigid import interpolate
from ekf_fusion_ros.mathlib.rigid import inverse

SPAN_US = 2_000_000
"""Time for which poses are kept, so that the slower of two tracks meets the faster one."""


class PoseTrack:
    """The last poses of one frame in another, by stamp."""

    def __init__(self) -> None:
        self._poses: deque[tuple[int, Pose]] = deque()

    @property
    def newest_us(self) -> int | None:
        """Stamp of the newest pose, None without one."""
        return self._poses[-1][0] if self._poses else None

    def push(self, time_us: int, pose: Pose) -> None:
        """Add a pose; a stamp that goes back begins a new track, a repeated one is ignored."""
        newest = self.newest_us
        if newest == time_us:
            return
        if newest is not None and time_us < newest:
            self._poses.clear()
        self._poses.append((time_us, pose))
        while time_us - self._poses[0][0] > SPAN_US:
            self._poses.popleft()

    def at(self, time_us: int) -> Pose | None:
        """Return the pose at a time, interpolated; None before the first and after the last."""
        later: tuple[int, Pose] | None = None
        for stamp, pose in reversed(self._poses):
            if stamp == time_us:
                return pose
            if stamp < time_us:
                if later is None:
                    return None
                share = (time_us - stamp) / (later[0] - stamp)
                return interpolate(pose, later[1], share)
            later = stamp, pose
        return None


class MapToOdom:
    """Compares map -> base_link and odom -> base_link at the newest time at which both are known.

    There map -> odom times odom -> base_link is the fused pose; until the next such time map ->
    odom stays, as the odometry drifts slowly.
    """

    def __init__(self) -> None:
        self.fused = PoseTrack()
        self.odometry = PoseTrack()
        self._newest: Pose | None = None

    def transform(self) -> Pose | None:
        """Return map -> odom (ENU), None before both tracks have met."""
        fused_us, odometry_us = self.fused.newest_us, self.odometry.newest_us
        if fused_us is None or odometry_us is None:
            return self._newest
        common_us = min(fused_us, odometry_us)
        fused, odometry = self.fused.at(common_us), self.odometry.at(common_us)
        if fused is not None and odometry is not None:
            self._newest = compose(fused, inverse(odometry))
        return self._newest
