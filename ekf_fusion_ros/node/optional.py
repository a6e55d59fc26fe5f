"""Message types that only a full ROS install has: used where present, named where absent."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

TYPES = {
    'toggle': ('robot_localization.srv', 'ToggleFilterProcessing'),
    'set_pose': ('robot_localization.srv', 'SetPose'),
    'datum': ('robot_localization.srv', 'SetDatum'),
    'toLL': ('robot_localization.srv', 'ToLL'),
    'fromLL': ('robot_localization.srv', 'FromLL'),
    'toLLArray': ('robot_localization.srv', 'ToLLArray'),
    'fromLLArray': ('robot_localization.srv', 'FromLLArray'),
    'set_gp_origin': ('geographic_msgs.msg', 'GeoPointStamped'),
    '/tf_static': ('tf2_msgs.msg', 'TFMessage'),
}
"""Where the type of a service or topic is found."""

SUBSTITUTES = {
    'toggle': 'call ~/set_enabled (std_srvs/SetBool)',
    'set_pose': 'publish to the topic set_pose (geometry_msgs/PoseWithCovarianceStamped)',
    'datum': 'publish to ~/set_origin (sensor_msgs/NavSatFix)',
    'set_gp_origin': 'publish to ~/set_origin (sensor_msgs/NavSatFix)',
    **dict.fromkeys(('toLL', 'fromLL', 'toLLArray', 'fromLLArray'),
                    'no standard type fits; in Python, point_of_map and map_of_point of '
                    'ekf_fusion_ros.map_origin, with the origin that ~/events tells'),
    '/tf_static': 'set messages.*.mount_xyz and mount_rpy',
}
"""What serves instead of a type that is not there."""


def found_types() -> Mapping[str, Any]:
    """Return the types that can be imported, by the name of their service or topic."""
    found = {name: imported(*place) for name, place in TYPES.items()}
    return {name: kind for name, kind in found.items() if kind is not None}


def imported(module: str, name: str) -> Any:
    """Return a class of a module, None where there is none."""
    try:
        return getattr(import_module(module), name, None)
    except ImportError:
        return None


def absence(found: Mapping[str, Any]) -> str:
    """Say in one line what is switched off and what serves instead, '' where nothing is off."""
    missing = [name for name in TYPES if name not in found]
    if not missing:
        return ''
    packages = sorted({TYPES[name][0].split('.')[0] for name in missing})
    instead: dict[str, list[str]] = {}
    for name in missing:
        instead.setdefault(SUBSTITUTES[name], []).append(name)
    words = [f'{", ".join(names)} ({substitute})' for substitute, names in instead.items()]
    return (f'switched off, because {", ".join(packages)} cannot be imported; in brackets what '
            f'serves instead: {"; ".join(words)}')
