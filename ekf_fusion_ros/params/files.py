"""Read a parameter file of any known kind into the tree."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field
from pathlib import Path
from typing import Any

from ekf_fusion_ros.params.px4 import read_ecl
from ekf_fusion_ros.params.px4 import read_px4
from ekf_fusion_ros.params.px4 import shortest
from ekf_fusion_ros.params.px4 import translate
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.params.tree import with_overrides
from ekf_fusion_ros.params.ulog import read_ulog
from ekf_fusion_ros.params.yaml_file import read_yaml


@dataclass(frozen=True, slots=True)
class LoadedParams:
    """What a parameter file holds.

    `unused` lists in words what has no counterpart here (PX4 and ECL names of features that are
    not there, sections of other nodes). `vehicle` and `output` are those entries of an ECL
    `params.txt` without their prefix.
    """

    params: Params
    unused: list[str] = field(default_factory=list)
    vehicle: dict[str, Any] = field(default_factory=dict)
    output: dict[str, Any] = field(default_factory=dict)


def load_file(path: str | Path, base: Params | None = None) -> LoadedParams:
    """Read a ROS 2 YAML, PX4 .params, ULog or ECL params.txt file on top of `base`.

    Raises ValueError with one sentence that names the file.
    """
    path = Path(path)
    base = Params() if base is None else base
    readers = {'.yaml': _load_yaml, '.yml': _load_yaml, '.txt': _load_ecl,
               '.params': _load_px4, '.ulg': _load_ulog}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise ValueError(
            f'{path}: expected a .yaml (ROS 2), .params or .ulg (PX4) or .txt (ECL) file')
    try:
        return reader(path, base)
    except OSError as error:
        raise ValueError(f'{path}: cannot be read ({error.strerror})') from None


def _load_yaml(path: Path, base: Params) -> LoadedParams:
    values, unused = read_yaml(path)
    return LoadedParams(_applied(path, base, values), unused)


def _load_px4(path: Path, base: Params) -> LoadedParams:
    return _from_px4(path, base, *read_px4(path))


def _load_ulog(path: Path, base: Params) -> LoadedParams:
    return _from_px4(path, base, *read_ulog(path))


def _from_px4(
    path: Path, base: Params, numbers: dict[str, float], remarks: list[str],
) -> LoadedParams:
    if not numbers:
        raise ValueError('; '.join([f'{path}: holds no parameter of EKF2 or LPE', *remarks]))
    foreign = {name: shortest(value) for name, value in numbers.items()}
    values, unused = _translated(path, foreign, base)
    return LoadedParams(_applied(path, base, values), unused + remarks)


def _load_ecl(path: Path, base: Params) -> LoadedParams:
    foreign = read_ecl(path)
    special: dict[str, dict[str, Any]] = {'vehicle': {}, 'output': {}}
    for name in [name for name in foreign if name.split('.')[0] in special]:
        group, _, rest = name.partition('.')
        special[group][rest] = foreign.pop(name)
    values, unused = _translated(path, foreign, base)
    limits = special['vehicle'].get('flow_limits')
    if limits is not None:
        # largest rate, then heights that concern the controller only
        values['ekf2.flow.max_rate'] = limits[0] if isinstance(limits, tuple) else limits
    return LoadedParams(_applied(path, base, values), unused, **special)


def _translated(
    path: Path, foreign: dict[str, Any], base: Params
) -> tuple[dict[str, Any], list[str]]:
    try:
        return translate(foreign, base.ekf2)
    except ValueError as error:
        raise ValueError(f'{path}: {error}') from None


def _applied(path: Path, base: Params, values: dict[str, Any]) -> Params:
    try:
        return with_overrides(base, values)
    except ValueError as error:
        raise ValueError(f'{path}: {error}') from None
