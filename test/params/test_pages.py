"""The pages name parameters that exist."""

from __future__ import annotations

from pathlib import Path
import re

import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params.spec import leaves

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / 'README.md', *sorted((ROOT / 'docs').glob('*.md'))]
GROUPS = 'ekf2|session|node|messages|two_topic|health|lpe|receivers'
NAME = re.compile(rf'`((?:{GROUPS})\.[a-z0-9_.<>*]+)[`:= ]')


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_named_parameters_exist(page):
    known = {name for name, _, _ in leaves(Params())}
    groups = {name.rsplit('.', 1)[0] for name in known}
    named = {match.rstrip('.') for match in NAME.findall(page.read_text(encoding='utf-8'))}
    wild = {name for name in named if '*' in name or '<' in name}
    unknown = named - wild - known - groups
    assert not {name for name in unknown if not any(k.startswith(name + '.') for k in known)}
    assert all(any(k.startswith(re.split(r'[*<]', name)[0]) for k in known) for name in wild)
