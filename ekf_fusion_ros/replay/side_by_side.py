"""Several estimators on one recording, and how they compare."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Mapping
from collections.abc import Sequence
from dataclasses import replace
import json
from pathlib import Path
from typing import Any

import numpy as np

from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.replay.options import ReplayOptions
from ekf_fusion_ros.replay.runner import check_paths
from ekf_fusion_ros.replay.runner import replay

Say = Callable[[str], None]
Row = tuple[str, Callable[[Mapping[str, Any]], str]]


def _distance(summary: Mapping[str, Any], key: str, which: str = 'fix_distance') -> str:
    found = summary[which]
    return '-' if found is None else f'{found[key]:.2f}'


def _first(summary: Mapping[str, Any]) -> str:
    first = summary['first_output']
    return '-' if first is None else f'{first - summary["start"]:.1f}'


ROWS: tuple[Row, ...] = (
    ('first output, s after the start', _first),
    ('rows', lambda summary: str(summary['rows'])),
    ('used fixes to the track, m RMS', lambda summary: _distance(summary, 'rms')),
    ('used fixes to the track, m at most', lambda summary: _distance(summary, 'largest')),
    ('withheld fixes to the track, m RMS',
     lambda summary: _distance(summary, 'rms', 'withheld_distance')),
    ('withheld fixes to the track, m at most',
     lambda summary: _distance(summary, 'largest', 'withheld_distance')),
    ('observations fused', lambda summary: str(_sum(summary, 'fused'))),
    ('observations rejected', lambda summary: str(_sum(summary, 'rejected'))),
    ('jumps of the state', lambda summary: str(sum(summary['resets'].values()))),
    ('CPU s', lambda summary: f'{summary["cpu_seconds"]:.1f}'),
)


def _sum(summary: Mapping[str, Any], key: str) -> int:
    return sum(aid[key] for aid in summary['aid_sources'].values())


def replay_side_by_side(
    options: ReplayOptions, names: Sequence[str], say: Say = print,
) -> dict[str, dict[str, Any]]:
    """Replay with each estimator into a folder of its name; say and write how they compare.

    Raises what `replay` raises.
    """
    chosen = {
        name: replace(options, output=options.output / name,
                      params=with_overrides(options.params, {'estimator': name}))
        for name in names}
    for one in chosen.values():
        check_paths(one)
    summaries: dict[str, dict[str, Any]] = {}
    for name, one in chosen.items():
        told: list[str] = []
        summaries[name] = replay(one, told.append)
        if len(summaries) == 1:
            # what it says of the recording holds for the others too
            for line in told:
                say(line)
    differences = _differences(options, summaries)
    for line in _table(summaries, differences):
        say(line)
    content = {'estimators': summaries, 'distance_between_tracks': differences}
    (options.output / 'comparison.json').write_text(
        json.dumps(content, indent=2, allow_nan=False) + '\n', encoding='utf-8')
    return summaries


def _table(
    summaries: Mapping[str, Mapping[str, Any]], differences: Mapping[str, Mapping[str, float]],
) -> list[str]:
    names = list(summaries)
    cells = [['', *names]]
    cells += [[what, *(tell(summaries[name]) for name in names)] for what, tell in ROWS]
    widths = [max(len(row[k]) for row in cells) for k in range(len(names) + 1)]
    lines = ['  '.join([row[0].ljust(widths[0]), *(
        cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]).rstrip()
        for row in cells]
    return [*lines, *(
        f'{pair}: tracks are {found["rms"]:.2f} m RMS apart, at most {found["largest"]:.2f} m'
        for pair, found in differences.items())]


def _differences(
    options: ReplayOptions, summaries: Mapping[str, Mapping[str, Any]],
) -> dict[str, dict[str, float]]:
    """Return the horizontal distance on the earth between the first track and each other, m."""
    first, *others = summaries
    tracks = {name: _track(options.output / name / 'trajectory.csv') for name in summaries}
    found = {}
    for name in others:
        shift = _shift(options, summaries[first]['origin'], summaries[name]['origin'])
        apart = _apart(tracks[first], tracks[name] + (0.0, *shift))
        if len(apart):
            found[f'{first}, {name}'] = {
                'rms': float(np.sqrt(np.mean(apart ** 2))), 'largest': float(apart.max())}
    return found


def _shift(
    options: ReplayOptions, origin: Mapping[str, float] | None, other: Mapping[str, float] | None,
) -> tuple[float, float]:
    """Return east and north of another origin in m; each estimator places its own."""
    if origin is None or other is None:
        return 0.0, 0.0
    north, east = make_projection(
        options.params.ekf2.earth.projection, origin['lat'], origin['lon'], origin['alt'],
    ).project(other['lat'], other['lon'])
    return east, north


def _track(path: Path) -> np.ndarray:
    """Return time, x, y of a trajectory (n, 3)."""
    return np.loadtxt(path, delimiter=',', skiprows=1, usecols=(0, 1, 2), ndmin=2)


def _apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    if not len(one) or not len(other):
        return np.zeros(0)
    both = one[(one[:, 0] >= other[0, 0]) & (one[:, 0] <= other[-1, 0])]
    distance: np.ndarray = np.hypot(*(
        np.interp(both[:, 0], other[:, 0], other[:, k]) - both[:, k] for k in (1, 2)))
    return distance
