"""Changes of parameters while the filter runs: which are taken, and why others are not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ekf_fusion_ros.params.spec import leaves
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.params.tree import with_overrides

REASONS = (
    (('delay_ms', 'horizon_ms', 'horizon_min_ms', 'hold_ms', 'sensor_interval_min_ms'),
     'buffers and fusion horizon are as long as it asks for'),
    (('position', 'mount_xyz', 'mount_rpy', 'mount_yaw', 'pitch'),
     'what was fused so far was taken with this mounting'),
    (('frame', 'type'), 'topics are open and listeners rely on their types and frames'),
    (('session.origin', 'session.origin_from'),
     'it counts at the start; publish to ~/set_origin to move the origin now'),
)
"""Ends of names, and why parameters of that kind stay."""

OTHER_REASON = 'it is built into the filter or the node at the start'


def changed(before: Params, changes: Mapping[str, Any]) -> Params:
    """Return the tree with live parameters changed, all of them or none.

    A parameter that is not live may be given its present value. Raises ValueError, in one
    sentence naming the parameter, for what cannot be changed.
    """
    after = with_overrides(before, changes)
    for name, old, new in differences(before, after):
        if name not in live_names(before):
            raise ValueError(
                f'{name} = {old!r} cannot become {new!r} while the node runs: {why_fixed(name)}; '
                'set it in the parameter file and start the node again')
    return after


def differences(before: Params, after: Params) -> list[tuple[str, Any, Any]]:
    """Return name, old and new value of every parameter that differs."""
    return [(name, old, new) for (name, old, _), (_, new, _) in zip(
        leaves(before), leaves(after), strict=True) if old != new]


def live_names(params: Params) -> set[str]:
    """Return the names of the parameters that may be changed while the filter runs."""
    return {name for name, _, spec in leaves(params) if spec.live}


def why_fixed(name: str) -> str:
    """Say why a parameter that is not live stays as it is."""
    for ends, reason in REASONS:
        if name.endswith(ends):
            return reason
    return OTHER_REASON
