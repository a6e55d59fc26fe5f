"""Several estimators on one recording: folders, table, distance between the tracks."""

from __future__ import annotations

from dataclasses import replace
import json

import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.replay import side_by_side
from ekf_fusion_ros.replay.options import ReplayOptions
from ekf_fusion_ros.replay.side_by_side import replay_side_by_side

TRACKS = {'ekf2': [(0.0, 0.0, 0.0), (2.0, 2.0, 0.0)],
          'other': [(1.0, 1.0, 3.0), (2.0, 2.0, 4.0)]}


@pytest.fixture
def options(tmp_path, monkeypatch):
    """Options, with a stand-in for the replay that writes the tracks above."""
    ran = []

    def stand_in(options, say):
        name = options.params
        ran.append(name)
        options.output.mkdir()
        rows = ''.join(f'{t},{x},{y}\n' for t, x, y in TRACKS[name])
        (options.output / 'trajectory.csv').write_text('t,x,y\n' + rows)
        say(f'topics of {name}')
        # 3 m further north, of which the tracks of the two are apart
        origin = {'lat': 47.0 + (3.0 / 111_180.0 if name == 'other' else 0.0), 'lon': 8.0,
                  'alt': 0.0}
        return {'origin': origin, 'start': 10.0, 'first_output': 12.5, 'rows': 2,
                'resets': {'position_ne': 1},
                'fix_distance': {'rms': 0.5, 'largest': 1.25}, 'withheld_distance': None,
                'cpu_seconds': 0.3,
                'aid_sources': {'gnss_position': {'fused': 7, 'rejected': 1}}}

    def chosen(params, overrides):
        if overrides['estimator'] not in TRACKS:
            raise ValueError('estimator: choose one')
        return overrides['estimator']

    monkeypatch.setattr(side_by_side, 'replay', stand_in)
    monkeypatch.setattr(side_by_side, 'with_overrides', chosen)
    (tmp_path / 'flight').touch()
    made = ReplayOptions(recording=tmp_path / 'flight', output=tmp_path, params=Params())
    return made, ran


def test_the_table_has_a_column_for_each(options):
    made, _ = options
    said = []
    replay_side_by_side(made, ['ekf2', 'other'], said.append)
    assert said[0] == 'topics of ekf2'
    assert 'topics of other' not in said
    head, first, *_ = said[1:]
    assert head.split() == ['ekf2', 'other']
    assert first.split()[-2:] == ['2.5', '2.5']
    # over the time both have: a row at 2 s, 4 m apart in numbers and 3 m by the origins
    assert said[-1] == 'ekf2, other: tracks are 7.00 m RMS apart, at most 7.00 m'
    written = json.loads((made.output / 'comparison.json').read_text())
    apart = written['distance_between_tracks']['ekf2, other']
    assert apart['largest'] == pytest.approx(7.0, abs=1e-3)
    assert set(written['estimators']) == {'ekf2', 'other'}


def test_a_wrong_name_is_refused_before_anything_runs(options):
    made, ran = options
    with pytest.raises(ValueError, match='choose one'):
        replay_side_by_side(replace(made), ['ekf2', 'nix'], print)
    assert ran == []
