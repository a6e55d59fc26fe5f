"""Mounting of sensors from /tf_static, where the parameters leave it at zero."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from ekf_fusion_ros.frames import frame_kind
from ekf_fusion_ros.live.static_tree import StaticTree
from ekf_fusion_ros.mathlib.rigid import Pose
from ekf_fusion_ros.mathlib.rotation import euler_321
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.params.tree import Params

ZERO = (0.0, 0.0, 0.0)
SMALL = 1e-6
"""m and rad below which a sensor counts as mounted at the origin of the body."""

GROUPS = {
    'imu': ('imu', 'imu'),
    'odometry': ('odometry', 'vision'),
    'fix': ('fix', 'gnss'),
    'magnetic_field': ('magnetic_field', ''),
    'range': ('range', 'range'),
    'fix_2': ('fix_2', ''),
    'fix_3': ('fix_3', ''),
}
"""Groups of `messages` and of `ekf2` that hold the mounting of a role."""


class StaticMounting:
    """Finds the mounting of each role in use whose parameters do not give it.

    It goes by the frame of the first message of a role, which must be FLU (REP-103).
    """

    def __init__(self, params: Params, roles: Collection[str]) -> None:
        self.tree = StaticTree()
        self._params = params
        self._body = params.node.base_link_frame
        self._open = {role for role in GROUPS if role in roles and self._unset(role)}
        self._frames: dict[str, str] = {}

    def _unset(self, role: str) -> bool:
        """True where neither message nor estimator parameters give a mounting."""
        messages, ekf2 = GROUPS[role]
        group = getattr(self._params.messages, messages)
        given = [getattr(group, name, ZERO) for name in ('mount_xyz', 'mount_rpy')]
        if ekf2:
            given.append(getattr(self._params.ekf2, ekf2).position)
        return all(one == ZERO for one in given)

    def wants(self, role: str) -> bool:
        """True until the frame of a role is known, where its mounting is looked for."""
        return role in self._open and role not in self._frames

    def note(self, role: str, frame: str) -> None:
        """Take the frame of the sensor of a role."""
        name = frame.lstrip('/')
        if name in ('', self._body) or frame_kind(name) != 'enu':
            self._open.discard(role)
        else:
            self._frames[role] = name

    @property
    def pending(self) -> bool:
        """True while a sensor is in a frame that nothing has tied to the body yet."""
        return bool(self._frames)

    def changes(self) -> dict[str, Any]:
        """Return parameters by name for the roles that can be placed now, each once."""
        changes: dict[str, Any] = {}
        for role, frame in list(self._frames.items()):
            pose = self.tree.pose(self._body, frame)
            if pose is not None:
                changes.update(self._mounting(role, pose))
                self._settle(role)
        return changes

    def missing(self) -> list[str]:
        """Return in sentences, once, which sensors nothing ties to the body."""
        sentences = [
            f'{role}: /tf_static does not tie its frame {frame!r} to {self._body!r}: it is taken '
            f'to be mounted there; publish that, or set messages.{GROUPS[role][0]}.mount_*'
            for role, frame in sorted(self._frames.items())]
        for role in list(self._frames):
            self._settle(role)
        return sentences

    def _settle(self, role: str) -> None:
        del self._frames[role]
        self._open.discard(role)

    def _mounting(self, role: str, pose: Pose) -> dict[str, Any]:
        name, _ = GROUPS[role]
        group = getattr(self._params.messages, name)
        found = {
            'mount_xyz': tuple(pose.position.tolist()),
            'mount_rpy': tuple(euler_321(matrix_from_quat(pose.quaternion)))}
        return {f'messages.{name}.{key}': value for key, value in found.items()
                if hasattr(group, key) and max(map(abs, value)) > SMALL}
