"""The import rules: downwards only, one face a folder, numpy alone below the faces."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
import subprocess
import sys

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / 'ekf_fusion_ros'

# Lowest first; a part may import itself and what stands below it.
LAYERS = (
    ('kernels.compile',),
    ('mathlib', 'geo', 'frames'),
    ('params', 'samples', 'buffer', 'estimator', 'observation'),
    ('kernels', 'odometry_drift'),
    ('ekf2', 'lpe', 'health', 'odometry_imu', 'motion_heading', 'receivers'),
    ('messages',),
    (
        'session', 'airspeed_conditions', 'completion', 'down_check', 'fix_assembly', 'fix_intake',
        'fused_output', 'holding', 'input_checks', 'inputs', 'map_origin', 'navigation_watch',
        'odometry_heading', 'pairing', 'roles', 'sample_check', 'sensor_rates', 'stamp_order',
        'statistics', 'turn_check', 'twist_check', 'warm_up',
    ),
    ('live',),
    ('analysis',),
    ('node', 'replay'),
    ('simulation',),
    ('__init__', '__main__'),
)
LEVEL = {part: level for level, parts in enumerate(LAYERS) for part in parts}
STRANGERS = ({'ekf2', 'lpe'}, {'node', 'replay'})
FAMILIES = ({'magnetometer', 'magnetic_fusion', 'magnetic_course'},)
CORE = {part for parts in LAYERS[:8] for part in parts}

MESSAGES = {
    'builtin_interfaces', 'diagnostic_msgs', 'geometry_msgs', 'nav_msgs', 'sensor_msgs',
    'std_msgs', 'std_srvs',
}
LIBRARIES = {
    'geo': {'pygeomag'},
    'params': {'yaml', 'pyulog'},
    'kernels.compile': {'numba', 'scipy'},
    'node': {'rclpy', 'rcl_interfaces', 'diagnostic_updater'} | MESSAGES,
    'replay': {'rosbags', 'tqdm', 'yaml', 'lz4', 'backports', 'compression'},
    'analysis': {'matplotlib'},
}


@dataclass(frozen=True)
class Import:
    """One import statement: where it stands, what it names, whether only a call runs it."""

    file: str
    part: str
    target: str
    lazy: bool


def part_of(dotted: str) -> str:
    """Return the part of the house a module inside the package belongs to."""
    words = dotted.split('.')
    return 'kernels.compile' if words[:2] == ['kernels', 'compile'] else words[0] or '__init__'


def imports() -> list[Import]:
    found = []
    for path in sorted(PACKAGE.rglob('*.py')):
        relative = path.relative_to(PACKAGE)
        part = part_of('.'.join(relative.with_suffix('').parts))
        tree = ast.parse(path.read_text(encoding='utf-8'))
        lazy = {
            id(node)
            for outer in ast.walk(tree)
            if isinstance(outer, (ast.FunctionDef, ast.AsyncFunctionDef)) or is_for_types(outer)
            for node in ast.walk(outer)
        }
        found += [
            Import(str(relative), part, target, id(node) in lazy)
            for node in ast.walk(tree)
            for target in targets(node)
        ]
    return found


def is_for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test) == 'TYPE_CHECKING'


def targets(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        assert node.level == 0, 'imports name the whole path'
        module = node.module or ''
        if module == 'ekf_fusion_ros':
            yield from (f'{module}.{alias.name}' for alias in node.names)
        else:
            yield module


IMPORTS = imports()
INSIDE = [item for item in IMPORTS if item.target.startswith('ekf_fusion_ros.')]
OUTSIDE = [
    item for item in IMPORTS
    if not item.target.startswith('ekf_fusion_ros')
    and item.target.split('.')[0] not in sys.stdlib_module_names
]


def inner(item: Import) -> str:
    return item.target.removeprefix('ekf_fusion_ros.')


def test_every_part_has_its_place() -> None:
    known = {part.split('.')[0] for part in LEVEL}
    parts = {path.stem for path in PACKAGE.iterdir() if path.suffix == '.py' or path.is_dir()}
    assert parts - {'__pycache__'} <= known
    assert len(INSIDE) > 50


def test_imports_go_downwards() -> None:
    upwards = [
        f'{item.file} imports {item.target}' for item in INSIDE
        if part_of(inner(item)) != item.part and LEVEL[part_of(inner(item))] > LEVEL[item.part]
    ]
    assert upwards == []


def test_alternatives_do_not_know_each_other() -> None:
    meetings = [
        f'{item.file} imports {item.target}' for item in INSIDE for pair in STRANGERS
        if item.part in pair and part_of(inner(item)) in pair - {item.part}
    ]
    assert meetings == []


def test_an_aid_source_knows_only_its_own_family() -> None:
    folder = 'ekf2.aid_sources.'
    foreign = []
    for item in INSIDE:
        if item.file.startswith('ekf2/aid_sources/') and inner(item).startswith(folder):
            source = Path(item.file).stem
            other = inner(item).removeprefix(folder).split('.')[0]
            related = source.split('_')[0] == other.split('_')[0] or any(
                {source, other} <= family for family in FAMILIES)
            if not related:
                foreign.append(f'{item.file} imports {item.target}')
    assert foreign == []


def test_each_library_has_its_folder() -> None:
    strays = [
        f'{item.file} imports {item.target}' for item in OUTSIDE
        if item.target.split('.')[0] not in {'numpy'} | LIBRARIES.get(item.part, set())
    ]
    assert strays == []


def test_below_the_faces_libraries_are_imported_when_needed() -> None:
    eager = [
        f'{item.file} imports {item.target}' for item in OUTSIDE
        if item.part in CORE and not item.lazy and item.target.split('.')[0] != 'numpy'
    ]
    assert eager == []


def test_simulation_meets_the_faces_only_when_called() -> None:
    eager = [
        f'{item.file} imports {item.target}' for item in INSIDE
        if item.part == 'simulation' and part_of(inner(item)) in {'node', 'replay'}
        and not item.lazy
    ]
    assert eager == []


NUMPY_ALONE = """
import sys

class OnlyNumpy:
    def find_spec(self, name, path=None, target=None):
        root = name.partition('.')[0]
        if root not in sys.stdlib_module_names and root not in ('numpy', 'ekf_fusion_ros'):
            raise ModuleNotFoundError(f'No module named {name!r}', name=root)

sys.meta_path.insert(0, OnlyNumpy())
sys.path.insert(0, sys.argv[1])
import ekf_fusion_ros
names = [name for name in ekf_fusion_ros.__all__ if getattr(ekf_fusion_ros, name) is None]
estimator = ekf_fusion_ros.Ekf2(ekf_fusion_ros.Params().ekf2)
print(names, estimator.nav_state())
"""


@pytest.mark.slow
def test_numpy_alone_is_enough_for_every_public_name() -> None:
    done = subprocess.run(
        [sys.executable, '-I', '-S', '-c', _with_numpy_path(), str(PACKAGE.parent)],
        capture_output=True, text=True, check=False)
    assert done.stderr == ''
    assert done.stdout.split() == ['[]', 'None']


def _with_numpy_path() -> str:
    """Return the script for an interpreter without site-packages but for numpy's own folder."""
    import numpy

    return f'import sys; sys.path.append({str(Path(numpy.__file__).parents[1])!r})' + NUMPY_ALONE
