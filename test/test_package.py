"""The package as it is declared, built by colcon and called from a shell."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path
import re
import shutil
import subprocess
import sys
from xml.etree import ElementTree

import pytest

import ekf_fusion_ros
from ekf_fusion_ros import __main__ as command_line

ROOT = Path(__file__).resolve().parents[1]
COMMANDS = ('fuser', 'replay', 'report', 'simulate')

ROSDEP_KEYS = {
    'numpy': 'python3-numpy',
    'yaml': 'python3-yaml',
    'numba': 'python3-numba',
    'scipy': 'python3-scipy',
    'lz4': 'python3-lz4',
    'rosbags': 'python3-rosbags-pip',
    'tqdm': 'python3-tqdm',
    'matplotlib': 'python3-matplotlib',
    'hypothesis': 'python3-hypothesis',
    'pymap3d': 'python3-pymap3d',
    'pyproj': 'python3-pyproj',
    'pytest': 'python3-pytest',
}
WITHOUT_KEY = {'pygeomag', 'pyulog', 'backports', 'compression', 'setuptools'}
"""pygeomag and pyulog are optional; rosbags brings backports.zstd, Python 3.14 has compression."""


def third_party(folder: Path) -> set[str]:
    """Return the root names of imported libraries, import statements and import_module alike."""
    names: set[str] = set()
    for path in folder.rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Import):
                names |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names.add(node.module or '')
            elif isinstance(node, ast.Call) and node.args:
                function = ast.unparse(node.func).rsplit('.', 1)[-1]
                first = node.args[0]
                if function in ('import_module', 'importorskip') and isinstance(
                        first, ast.Constant):
                    names.add(str(first.value))
    roots = {name.partition('.')[0] for name in names}
    ours = {'ekf_fusion_ros', ''} | {
        path.stem for path in (ROOT / 'test').rglob('*') if path.parent.name != 'stand_ins'}
    return roots - set(sys.stdlib_module_names) - ours


def declared(*tags: str) -> set[str]:
    root = ElementTree.parse(ROOT / 'package.xml').getroot()
    return {str(element.text) for tag in tags for element in root.iter(tag)}


def test_package_xml_declares_every_import_of_the_package() -> None:
    imported = third_party(ROOT / 'ekf_fusion_ros') | third_party(ROOT / 'launch')
    imported -= WITHOUT_KEY
    keys = {ROSDEP_KEYS.get(name, name) for name in imported}
    assert 'rclpy' in keys
    assert keys - declared('exec_depend', 'depend') == set()


def test_package_xml_declares_every_import_of_the_tests() -> None:
    keys = {ROSDEP_KEYS.get(name, name) for name in third_party(ROOT / 'test') - WITHOUT_KEY}
    assert keys - declared('exec_depend', 'depend', 'test_depend') == set()


def test_nothing_is_declared_that_nobody_imports() -> None:
    imported = set[str]().union(
        *(third_party(ROOT / folder) for folder in ('ekf_fusion_ros', 'launch', 'test')))
    keys = {ROSDEP_KEYS.get(name, name) for name in imported}
    assert declared('exec_depend', 'depend', 'test_depend') - keys == set()


def test_one_version() -> None:
    setup = (ROOT / 'setup.py').read_text(encoding='utf-8')
    changelog = (ROOT / 'CHANGELOG.rst').read_text(encoding='utf-8')
    version = ekf_fusion_ros.__version__

    assert re.findall(r"version='([^']+)'", setup) == [version]
    assert declared('version') == {version}
    assert re.search(r'^(\d+\.\d+\.\d+)', changelog, re.MULTILINE).group(1) == version  # type: ignore[union-attr]


def test_every_command_has_a_main() -> None:
    pytest.importorskip('rclpy')
    pytest.importorskip('rosbags')
    for name, (module, _) in command_line.MODULES.items():
        if module:
            assert callable(importlib.import_module(module).main), name


def run_command(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, '-m', 'ekf_fusion_ros', *arguments], cwd=ROOT, capture_output=True,
        text=True, check=False)


def test_help_names_every_command() -> None:
    done = run_command('--help')
    assert done.returncode == 0
    assert set(re.findall(r'^  (\w+)', done.stdout, re.MULTILINE)) == set(command_line.MODULES)


@pytest.mark.parametrize('arguments', [(), ('fuse',), ('report',)])
def test_unknown_or_later_command_ends_with_status_2_and_words(arguments: tuple[str]) -> None:
    done = run_command(*arguments)
    assert done.returncode == 2
    assert done.stdout == ''
    assert 'Traceback' not in done.stderr
    assert (arguments[0] if arguments else 'usage') in done.stderr


def test_missing_library_is_named_with_what_installs_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing(name: str) -> None:
        raise ModuleNotFoundError("No module named 'rosbags'", name='rosbags.highlevel')

    monkeypatch.setattr(command_line, 'import_module', missing)
    assert command_line.main(['replay', 'bag']) == 1
    assert "pip install 'ekf_fusion_ros[replay]'" in capsys.readouterr().err


def test_a_defect_of_our_own_is_not_taken_for_a_missing_library(
    monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(name: str) -> None:
        raise ModuleNotFoundError('No module', name='ekf_fusion_ros.nowhere')

    monkeypatch.setattr(command_line, 'import_module', broken)
    with pytest.raises(ModuleNotFoundError):
        command_line.main(['replay', 'bag'])


def test_public_names_are_there_and_others_are_not() -> None:
    assert set(ekf_fusion_ros.__all__) <= set(dir(ekf_fusion_ros))
    for name in ekf_fusion_ros.__all__:
        assert getattr(ekf_fusion_ros, name).__name__ == name
    with pytest.raises(AttributeError, match='Ekf3'):
        ekf_fusion_ros.Ekf3  # noqa: B018


@pytest.mark.slow
def test_colcon_build_gives_what_ros2_run_executes(tmp_path: Path) -> None:
    colcon = Path(sys.executable).with_name('colcon')
    found = str(colcon) if colcon.exists() else shutil.which('colcon')
    if found is None:
        pytest.skip('colcon is not installed')
    shutil.copytree(
        ROOT, tmp_path / 'src' / 'ekf_fusion_ros',
        ignore=shutil.ignore_patterns('.*', 'build', 'install', 'log', '*.egg-info'))
    built = subprocess.run(
        [found, 'build'], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stdout + built.stderr

    prefix = tmp_path / 'install' / 'ekf_fusion_ros'
    for command in COMMANDS:
        assert (prefix / 'lib' / 'ekf_fusion_ros' / command).is_file()
    share = prefix / 'share'
    assert (share / 'ament_index/resource_index/packages/ekf_fusion_ros').is_file()
    assert (share / 'ekf_fusion_ros/package.xml').is_file()
    assert (share / 'ekf_fusion_ros/config/px4_ecl.yaml').is_file()
    library = next(prefix.glob('lib/python*/site-packages'))
    assert (library / 'ekf_fusion_ros/geo/ecl_field_table.csv').is_file()
    assert (library / 'ekf_fusion_ros/ekf2/aid_sources/__init__.py').is_file()

    said = subprocess.run(
        ['bash', '-c', '. install/setup.bash && install/ekf_fusion_ros/lib/ekf_fusion_ros/report'],
        cwd=tmp_path, capture_output=True, text=True, check=False)
    assert said.returncode == 2
    assert 'not in this release' in said.stderr
