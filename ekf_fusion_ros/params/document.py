"""Write config/default.yaml and docs/parameters.md from the parameter declarations.

`python3 -m ekf_fusion_ros.params.document` in the root of the repository renews both.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import re
import textwrap
from typing import Any

from ekf_fusion_ros.params import px4
from ekf_fusion_ros.params.spec import ParamSpec
from ekf_fusion_ros.params.spec import leaves
from ekf_fusion_ros.params.tree import Params

WIDTH = 99
HEADER = """\
# Every parameter of ekf_fusion_ros with its default.
# Generated from the declarations in ekf_fusion_ros/params: `python3 -m
# ekf_fusion_ros.params.document` renews it. Copy the lines you change into a file of your own.

/**:
  ros__parameters:
"""
TABLE_HEAD = (
    '| name | default | unit | range | what | live | PX4 |', '|---|---|---|---|---|---|---|')
INTRODUCTION = """\
# Parameters

Generated from the declarations in `ekf_fusion_ros/params`
(`python3 -m ekf_fusion_ros.params.document` renews this page).

The names are the same everywhere: ROS 2 parameters of the node, `--set name=value` and `--params
FILE` of the replay, and the dataclass tree `ekf_fusion_ros.Params`. Frames and units inside
`ekf2` are those of PX4: NED earth, FRD body, SI. A PX4 `.params` file and a PX4 log (`.ulg`) are
read as they are; the last column names what each parameter is called there.

Those marked live can be changed while the node runs (`ros2 param set`): noise, gates and checks
act from the next measurement on, `node.use_<input>` switches an input that the node listens to. A
change of any other is refused with the reason.
"""


def default_yaml(params: Params) -> str:
    """Return a ROS 2 parameter file with every parameter, its words, unit and range."""
    lines: list[str] = []
    open_groups: list[str] = []
    for name, value, spec in leaves(params):
        *groups, last = name.split('.')
        shared = _shared_length(groups, open_groups)
        for depth in range(shared, len(groups)):
            lines.append(f'{_indent(depth)}{groups[depth]}:')
        open_groups = groups
        indent = _indent(len(groups))
        lines += textwrap.wrap(
            _words(spec), WIDTH, initial_indent=f'{indent}# ', subsequent_indent=f'{indent}# ')
        lines.append(f'{indent}{last}: {yaml_value(value)}')
    return HEADER + '\n'.join(lines) + '\n'


def markdown(params: Params) -> str:
    """Return the reference page: one table a group."""
    foreign = _px4_names(params)
    lines = [INTRODUCTION]
    group = None
    for name, value, spec in leaves(params):
        prefix, _, _ = name.rpartition('.')
        if prefix != group:
            group = prefix
            lines += [f'\n## {group or "general"}\n', *TABLE_HEAD]
        cells = (f'`{name}`', f'`{yaml_value(value)}`', spec.unit, _range(spec), spec.description,
                 'yes' if spec.live else '',
                 ', '.join(f'`{px4_name}`' for px4_name in foreign.get(name, ())))
        lines.append('| ' + ' | '.join(cell.replace('|', '\\|') for cell in cells) + ' |')
    return '\n'.join(lines) + '\n'


def yaml_value(value: Any) -> str:
    """Return a value as YAML 1.1 reads it back with the same type."""
    if isinstance(value, bool):
        return 'true' if value else 'false'
    if isinstance(value, tuple):
        return f'[{", ".join(yaml_value(element) for element in value)}]'
    if isinstance(value, float):
        # 1e-05 without a point would be text.
        return re.sub(r'^(-?\d+)e', r'\1.0e', repr(value))
    return repr(value)


def write(root: Path) -> None:
    """Renew both files below the root of the repository."""
    params = Params()
    (root / 'config' / 'default.yaml').write_text(default_yaml(params), encoding='utf-8')
    (root / 'docs' / 'parameters.md').write_text(markdown(params), encoding='utf-8')


def _shared_length(left: list[str], right: list[str]) -> int:
    count = 0
    while count < min(len(left), len(right)) and left[count] == right[count]:
        count += 1
    return count


def _indent(depth: int) -> str:
    return '  ' * (depth + 2)


def _words(spec: ParamSpec) -> str:
    facts = [text for text in (spec.unit, _range(spec), spec.px4) if text]
    return spec.description + (f' [{"; ".join(facts)}]' if facts else '')


def _range(spec: ParamSpec) -> str:
    if spec.choices:
        return ', '.join(spec.choices)
    if spec.min is None and spec.max is None:
        return ''
    low = '' if spec.min is None else f'{spec.min:g}'
    high = '' if spec.max is None else f'{spec.max:g}'
    return f'{low} .. {high}'.strip()


def _px4_names(params: Params) -> dict[str, list[str]]:
    names: dict[str, list[str]] = {}
    for name, _, spec in leaves(params):
        if spec.px4:
            names[name] = [spec.px4]
    for name, foreign in _expanded_names():
        known = names.setdefault(name, [])
        if foreign.split()[0].isupper() and foreign not in known:
            known.append(foreign)
    return names


def _expanded_names() -> Iterator[tuple[str, str]]:
    """Yield (our name, PX4 name) where one PX4 parameter stands for several of ours."""
    for foreign, bits in px4.BIT_MASKS.items():
        for index, name in enumerate(bits):
            yield name, f'{foreign} bit {index}'
    for foreign, (name, _) in px4.ENUMERATIONS.items():
        yield name, foreign
    for table in (px4.SWITCHES, px4.MICROSECONDS, px4.SECONDS, px4.MILLISECONDS):
        for foreign, name in table.items():
            yield name, foreign
    for foreign, name in px4.AXES.items():
        yield name, f'{foreign}X/Y/Z'


if __name__ == '__main__':
    write(Path.cwd())
