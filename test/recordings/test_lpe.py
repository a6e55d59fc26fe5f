"""Recordings through the local position estimator, by default parameters."""

from __future__ import annotations

import csv

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
