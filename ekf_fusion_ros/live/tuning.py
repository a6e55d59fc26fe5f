"""Parameters that change while the node runs: checked together, carried out, announced."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from typing import Any

from ekf_fusion_ros.live.steering import Steering
from ekf_fusion_ros.params.live import changed
from ekf_fusion_ros.params.live import differences
from ekf_fusion_ros.params.spec import leaves
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.params.tree import with_overrides
from ekf_fusion_ros.session import FusionSession

SWITCH = 'node.use_'


class Tuning:
    """Takes changes of live parameters for a session; those of node.use_* switch inputs."""

    def __init__(self, params: Params, session: FusionSession, steering: Steering) -> None:
        """Begin with the parameters that the session was made with."""
        self._session = session
        self._adopt(params)
        self._steering = steering

    def obstacle(self, changes: Mapping[str, Any]) -> str:
        """Return in one sentence why these changes cannot be made together, '' where they can."""
        news = self._news(changes)
        if not news:
            return ''
        try:
            after = changed(self._params, news)
        except ValueError as error:
            return str(error)
        refusals = [self._steering.obstacle(*one) for one in switches(news, after)]
        return next(filter(None, refusals), '')

    def change(self, changes: Mapping[str, Any]) -> None:
        """Make changes that `obstacle` has nothing against, and announce what is new."""
        news = self._news(changes)
        if not news:
            return
        before, after = self._params, changed(self._params, news)
        self._adopt(after)
        for role, on in switches(news, after):
            self._steering.switch(role, on)
        told = [one for one in differences(before, after) if not one[0].startswith(SWITCH)]
        if told:
            self._session.adopt(after)
            words = ', '.join(f'{name} = {new} (was {old})' for name, old, new in told)
            self._session.announce(f'parameters changed on request: {words}')

    def mount(self, mounting: Mapping[str, Any]) -> None:
        """Take the mounting of sensors of which nothing was fused yet."""
        self._adopt(with_overrides(self._params, mounting))
        self._session.adopt(self._params)
        words = ', '.join(
            f'{name} = ({", ".join(f"{part:.4g}" for part in value)})'
            for name, value in mounting.items())
        self._session.announce(f'mounting by /tf_static: {words}')

    def _adopt(self, params: Params) -> None:
        self._params = params
        self._values = {name: value for name, value, _ in leaves(params)}

    def _news(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Return what is not so already; a whole file of parameters holds little of that.

        Inputs count always: a service may have switched them.
        """
        return {name: value for name, value in changes.items()
                if name.startswith(SWITCH) or self._values.get(name) != comparable(value)}


def comparable(value: Any) -> Any:
    """Return a value of ROS, where lists are arrays, as our parameters have it."""
    return tuple(value) if isinstance(value, (list, array)) else value


def switches(changes: Mapping[str, Any], params: Params) -> list[tuple[str, bool]]:
    """Return role and wanted state of the inputs that changes name."""
    roles = [name.removeprefix(SWITCH) for name in changes if name.startswith(SWITCH)]
    return [(role, bool(getattr(params.node, f'use_{role}'))) for role in roles]
