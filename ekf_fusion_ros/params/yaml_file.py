"""Read parameters from a ROS 2 parameter file."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Mapping
from pathlib import Path
from typing import Any

NODE_NAME = 'fuser'
ROS_OWN = ('use_sim_time', 'start_type_description_service', 'qos_overrides')
"""Parameters every ROS 2 node has; they say nothing about the estimator."""


def read_yaml(path: Path) -> tuple[dict[str, Any], list[str]]:
    """Return {dotted name: value} for this node and the names that are for somebody else.

    Takes `/**`, `fuser` and `/namespace/fuser` sections, nested or dotted, as ROS 2 does; a
    later section wins. Raises ValueError naming the file.
    """
    tree = _parse(path)
    values: dict[str, Any] = {}
    unused: list[str] = []
    sections = list(_sections(tree, ''))
    if not sections:
        raise ValueError(f'{path}: no ros__parameters section, write "/**: ros__parameters:"')
    for node, section in sections:
        if node.rsplit('/', 1)[-1] not in (NODE_NAME, '**', '*'):
            unused.append(f'{node} (section of another node)')
            continue
        if not isinstance(section, Mapping):
            raise ValueError(f'{path}: ros__parameters of {node} must hold "name: value" lines')
        values.update(_flat(section, ''))
    return {name: value for name, value in values.items() if not _is_ros_own(name)}, unused


def _parse(path: Path) -> Any:
    import yaml

    try:
        with path.open(encoding='utf-8') as stream:
            return yaml.load(stream, Loader=_strict_loader())
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f'{path}: not a YAML file: {_one_line(error)}') from None


def _strict_loader() -> Any:
    """Return a safe loader that refuses a key written twice instead of taking the last."""
    import yaml

    class StrictLoader(yaml.SafeLoader):
        def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
            keys = [key.value for key, _ in node.value]
            for index, key in enumerate(keys):
                if key in keys[:index]:
                    mark = node.value[index][0].start_mark
                    raise yaml.constructor.ConstructorError(None, None, f'{key} twice', mark)
            return super().construct_mapping(node, deep)

    return StrictLoader


def _one_line(error: Exception) -> str:
    mark = getattr(error, 'problem_mark', None)
    words = getattr(error, 'problem', None) or str(error)
    return f'{words} in line {mark.line + 1}' if mark else ' '.join(words.split())


def _sections(tree: Any, node: str) -> Iterator[tuple[str, Any]]:
    if not isinstance(tree, Mapping):
        return
    for key, value in tree.items():
        if key == 'ros__parameters':
            yield node, value
        else:
            yield from _sections(value, f'{node}/{str(key).strip("/")}')


def _flat(section: Mapping[Any, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for key, value in section.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f'{prefix}{key}.')
        else:
            yield f'{prefix}{key}', value


def _is_ros_own(name: str) -> bool:
    return name.split('.', 1)[0] in ROS_OWN
