"""Parameters that change while the node runs: checked together, carried out, announced."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ekf_fusion_ros.live.steering import Steering
from ekf_fusion_ros.params.live import changed
from ekf_fusion_ros.params.live import differences
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.params.tree import with_overrides
from ekf_fusion_ros.session import FusionSession

SWITCH = 'node.use_'


class Tuning:
    """Takes changes of live parameters for a session; those of node.use_* switch inputs."""

    def __init__(self, params: Params, session: FusionSession, steering: Steering) -> None:
        """Begin with the parameters that the session was made with."""
        self._params = params
        self._session = session
        self._steering = steering

    def obstacle(self, changes: Mapping[str, Any]) -> str:
        """Return in one sentence why these changes cannot be made together, '' where they can."""
        try:
            after = changed(self._params, changes)
        except ValueError as error:
            return str(error)
        refusals = [self._steering.obstacle(*one) for one in switches(changes, after)]
        return next(filter(None, refusals), '')

    def change(self, changes: Mapping[str, Any]) -> None:
        """Make changes that `obstacle` has nothing against, and announce what is new."""
        before, self._params = self._params, changed(self._params, changes)
        for role, on in switches(changes, self._params):
            self._steering.switch(role, on)
        news = [one for one in differences(before, self._params) if not one[0].startswith(SWITCH)]
        if news:
            self._session.adopt(self._params)
            words = ', '.join(f'{name} = {new} (was {old})' for name, old, new in news)
            self._session.announce(f'parameters changed on request: {words}')

    def mount(self, mounting: Mapping[str, Any]) -> None:
        """Take the mounting of sensors of which nothing was fused yet."""
        self._params = with_overrides(self._params, mounting)
        self._session.adopt(self._params)
        words = ', '.join(
            f'{name} = ({", ".join(f"{part:.4g}" for part in value)})'
            for name, value in mounting.items())
        self._session.announce(f'mounting by /tf_static: {words}')


def switches(changes: Mapping[str, Any], params: Params) -> list[tuple[str, bool]]:
    """Return role and wanted state of the inputs that changes name."""
    roles = [name.removeprefix(SWITCH) for name in changes if name.startswith(SWITCH)]
    return [(role, bool(getattr(params.node, f'use_{role}'))) for role in roles]
