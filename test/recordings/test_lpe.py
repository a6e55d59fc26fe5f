"""Recordings through the local position estimator, by default parameters."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from recordings.scores import horizontal_errors

from ekf_fusion_ros.__main__ import main
from ekf_fusion_ros.replay.lpe_log import COLUMNS

RECORDINGS = ('rl_husky', 'px4_sitl_v19_position', 'inav_quad_optflow')


@pytest.mark.slow
@pytest.mark.parametrize('name', RECORDINGS)
def test_the_track_stays_with_the_fixes(shared, tmp_path, name):
    """Throughout within three of the stated sigma plus 3 m."""
    recording = shared / 'data' / name / f'{name}_mcap'
    if not recording.exists():
        pytest.skip(f'no {recording.name} in the shared folder')
    output = tmp_path / 'out'
    assert main(['replay', str(recording), '--output', str(output), '--no-bag',
                 '--estimator', 'lpe', '--log-states']) == 0
    _, distance, limit = horizontal_errors(recording, output, 0.11, assumed_sigma=2.5)
    assert len(distance) > 250
    assert (distance < limit + 1.0).all()
    with (output / 'estimator.csv').open(encoding='utf-8') as stream:
        rows = csv.reader(stream)
        assert tuple(next(rows)) == COLUMNS
        last = np.array([row for row in rows][-1], dtype=float)
    assert np.isfinite(last[:24]).all()


@pytest.mark.slow
def test_flow_and_range_agree_with_the_fixes_and_bridge_gaps(shared, tmp_path):
    """Of a minute each, the first in brisk flight; blind, position stands still meanwhile."""
    name = 'inav_quad_optflow'
    recording = shared / 'data' / name / f'{name}_mcap'
    if not recording.exists():
        pytest.skip(f'no {recording.name} in the shared folder')
    camera = ('--topic', 'range=/range', '--topic', 'flow=/flow',
              '--set', 'messages.flow.axes=frd')
    farthest = {}
    for folder, extra in (('seeing', camera), ('blind', ())):
        output = tmp_path / folder
        assert main(['replay', str(recording), '--output', str(output), '--no-bag',
                     '--estimator', 'lpe', '--withhold', 'fix=450:510,600:660', *extra]) == 0
        at, distance, limit = horizontal_errors(recording, output, 0.11, assumed_sigma=2.5)
        gaps = [(at > at[0] + first) & (at < at[0] + first + 63.0) for first in (450.0, 600.0)]
        farthest[folder] = np.array([distance[gap].max() for gap in gaps])
        rest = ~np.any(gaps, axis=0)
        assert (distance[rest] < limit[rest] + 1.0).all()
    assert (farthest['seeing'] < 0.5 * farthest['blind']).all()
    assert (farthest['seeing'] < 8.0).all()
    aids = json.loads((tmp_path / 'seeing' / 'summary.json').read_text(encoding='utf-8'))
    flow = aids['aid_sources']['optical_flow']
    assert flow['fused'] > 7500
    assert flow['rejected'] < 0.01 * flow['fused']
