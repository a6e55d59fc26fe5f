"""The generated parameter file and page."""

from __future__ import annotations

from pathlib import Path

import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import load_file
from ekf_fusion_ros.params.document import default_yaml
from ekf_fusion_ros.params.document import markdown
from ekf_fusion_ros.params.document import yaml_value
from ekf_fusion_ros.params.spec import leaves


@pytest.mark.parametrize(
    ('path', 'make'), [('config/default.yaml', default_yaml), ('docs/parameters.md', markdown)])
def test_committed_file_is_in_step(repository: Path, path: str, make: object) -> None:
    assert callable(make)
    written = (repository / path).read_text(encoding='utf-8')
    assert written == make(Params()), 'run python3 -m ekf_fusion_ros.params.document'


def test_default_yaml_holds_every_parameter_with_its_default(repository: Path) -> None:
    yaml = pytest.importorskip('yaml')
    tree = yaml.safe_load((repository / 'config/default.yaml').read_text(encoding='utf-8'))
    for name, value, _ in leaves(Params()):
        node = tree['/**']['ros__parameters']
        for part in name.split('.'):
            node = node[part]
        assert (tuple(node) if isinstance(node, list) else node) == value, name
        assert isinstance(value, tuple) or type(node) is type(value), name


def test_profiles_are_accepted(repository: Path) -> None:
    for path in sorted((repository / 'config').glob('*.yaml')):
        assert load_file(path).unused == [], path


@pytest.mark.parametrize('value', [1e-5, 1.5e-7, -2e-9, 1e22, 0.1, 3.0, True, 4, 'none', 'off'])
def test_values_survive_yaml_with_their_type(value: object) -> None:
    yaml = pytest.importorskip('yaml')
    read = yaml.safe_load(yaml_value(value))
    assert read == value
    assert type(read) is type(value)
