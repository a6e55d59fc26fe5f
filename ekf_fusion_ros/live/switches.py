"""What is switched on: the whole fusion, and each input by itself."""

from __future__ import annotations

from collections.abc import Collection

from ekf_fusion_ros.roles import FIX_OF_PART

DISABLED = ('disabled', 'the node is disabled: call ~/set_enabled with data: true')


class Switches:
    """Keeps messages from the filter while they are switched off."""

    def __init__(self, roles: Collection[str], inertial_role: str, *, enabled: bool) -> None:
        self._roles = tuple(roles)
        self._inertial = inertial_role
        self._off: set[str] = set()
        self.enabled = enabled

    def switch(self, role: str, on: bool) -> str:
        """Switch an input; return '' where that is done, else in one sentence why not."""
        obstacle = self.obstacle(role, on)
        if not obstacle and role in self._roles:
            (self._off.discard if on else self._off.add)(role)
        return obstacle

    def obstacle(self, role: str, on: bool) -> str:
        """Return in one sentence why an input cannot be switched, '' where it can."""
        if role not in self._roles and on:
            return (f'{role} is not subscribed to: start the node with node.use_{role}: true to '
                    'switch it later')
        if role == self._inertial and not on:
            return (f'{role} carries the time of the filter and cannot be switched off alone: '
                    'call ~/set_enabled with data: false to stop the fusion')
        return ''

    def is_on(self, role: str) -> bool:
        """Return whether messages of a role reach the filter; parts of a fix go with it."""
        return role not in self._off and FIX_OF_PART.get(role) not in self._off

    def refusal(self, role: str) -> tuple[str, str] | None:
        """Return reason and sentence why a message of a role is kept back, None if it is not."""
        if not self.enabled:
            return DISABLED
        if self.is_on(role):
            return None
        return 'switched_off', f'{role} is switched off: call ~/use_{role} with data: true'
