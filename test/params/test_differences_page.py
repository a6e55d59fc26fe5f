"""The page of differences knows every default that the profile of the reference changes."""

import re

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import load_file
from ekf_fusion_ros.params.spec import leaves


def differing(repository):
    ours = {name: value for name, value, _ in leaves(Params())}
    profile = load_file(repository / 'config' / 'px4_ecl.yaml').params
    return {name for name, value, _ in leaves(profile) if value != ours[name]}


def test_every_differing_default_has_a_reason_and_figures(repository):
    page = (repository / 'docs' / 'px4_differences.md').read_text(encoding='utf-8')
    table, _, figures = page.partition('## Figures of the defaults')
    names = differing(repository)
    assert names
    assert names == set(re.findall(r'### `([\w.]+)`', figures))
    assert [name for name in names if f'`{name}`' not in table] == []
