"""The demo: simulate flights into recordings, replay them, compare with the truth."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import redirect_stderr
from contextlib import redirect_stdout
import csv
from importlib import import_module
import json
from pathlib import Path
import secrets
import shutil
import sys

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.analysis.comparison import Comparison
from ekf_fusion_ros.analysis.comparison import Rms
from ekf_fusion_ros.analysis.comparison import Score
from ekf_fusion_ros.analysis.errors import Track
from ekf_fusion_ros.frames import swap_enu_ned
from ekf_fusion_ros.geo.projection import LocalTangent
from ekf_fusion_ros.simulation.scenario import Arrival
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.showcase import DESCRIPTION
from ekf_fusion_ros.simulation.showcase import FIX_DELAY
from ekf_fusion_ros.simulation.showcase import OUTAGE
from ekf_fusion_ros.simulation.showcase import showcase
from ekf_fusion_ros.simulation.truth_file import write_truth

Array = NDArray[np.float64]
BOUND = 0.6


class DemoError(RuntimeError):
    """A step of the demo failed; the text says which and where to look."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo; return 0 where the claim holds, 1 where not, 2 for wrong arguments."""
    try:
        options = _parser().parse_args(argv)
    except SystemExit as stop:
        return int(stop.code or 0)
    seeds = options.seed or [secrets.randbelow(1_000_000) for _ in range(options.seeds)]
    print(DESCRIPTION)
    print(f'seeds     {" ".join(str(seed) for seed in seeds)}\n')
    try:
        flights = {seed: _fly(seed, options.output) for seed in seeds}
        scores = {seed: flight.score() for seed, flight in flights.items()}
        _print_table(scores)
        picture = _draw(flights[seeds[0]], seeds[0], options.output)
    except DemoError as error:
        print(f'demo: {error}', file=sys.stderr)
        return 1
    worst = float(np.max([score.worst_ratio for score in scores.values()]))
    holds = worst <= BOUND
    print(f'\nworst horizontal ratio of fused to the better single source: {worst:.2f} '
          f'({"within" if holds else "NOT within"} {BOUND})')
    print(f'fused recording: {_folder(options.output, seeds[0]) / "replay" / "fused"}')
    print(f'picture:         {picture}')
    return 0 if holds else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='demo', description='Simulate flights with drifting odometry and a GPS outage, fuse '
        'them, and compare fused, odometry-only and GPS-only tracks with the truth.')
    parser.add_argument('--output', type=Path, default=Path('demo_output'), metavar='DIR',
                        help='folder for recordings and results (default: %(default)s)')
    parser.add_argument('--seeds', type=_positive, default=5, metavar='N',
                        help='number of flights with seeds drawn now (default: %(default)s)')
    parser.add_argument('--seed', type=_seed, action='append', metavar='S',
                        help='fly this seed instead; may be repeated')
    return parser


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f'{text}: at least 1')
    return number


def _seed(text: str) -> int:
    number = int(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f'{text}: must not be negative')
    return number


def _folder(output: Path, seed: int) -> Path:
    return output / f'seed-{seed}'


def _fly(seed: int, output: Path) -> Comparison:
    """Simulate, record and replay the flight of a seed."""
    folder = _folder(output, seed)
    scenario = showcase(seed)
    arrivals = list(scenario.arrivals())
    try:
        from ekf_fusion_ros.replay.recording import write_recording

        # Only a folder of an earlier run of this seed is ever replaced.
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        write_recording(folder / 'recording', arrivals)
        write_truth(folder / 'truth.csv', scenario)
    except (OSError, ModuleNotFoundError) as error:
        raise DemoError(f'cannot write the recording: {error}') from error
    print(f'seed {seed}: {len(arrivals)} messages recorded, replaying ...', flush=True)
    _replay(folder)
    return _compare(scenario, arrivals, folder / 'replay')


def _replay(folder: Path) -> None:
    """Replay as the command line does; what it says goes to replay.log."""
    log = folder / 'replay.log'
    replay = import_module('ekf_fusion_ros.replay.cli')
    arguments = [str(folder / 'recording'), '--output', str(folder / 'replay')]
    with log.open('w', encoding='utf-8') as stream:
        with redirect_stdout(stream), redirect_stderr(stream):
            status = replay.main(arguments)
    if status != 0:
        raise DemoError(f'replay of {folder / "recording"} failed with {status}: see {log}')


def _compare(scenario: Scenario, arrivals: list[Arrival], replayed: Path) -> Comparison:
    odometry = _odometry(scenario, arrivals)
    motion = scenario.trajectory.motion(odometry.time)
    fused, sigma = _fused(scenario, replayed)
    return Comparison(
        truth=Track(odometry.time, _enu(motion.position)), odometry=odometry,
        fixes=_fixes(scenario, arrivals), fused=fused, fused_sigma=sigma, outage=OUTAGE)


def _odometry(scenario: Scenario, arrivals: list[Arrival]) -> Track:
    samples = [a.sample for a in arrivals if a.role == 'odometry']
    time = np.array([sample.time_us - scenario.start_us for sample in samples]) * 1e-6
    return Track(time, _enu(np.array([sample.position for sample in samples])))


def _fixes(scenario: Scenario, arrivals: list[Arrival]) -> Track:
    """Return the fixes at the times of measurement."""
    tangent = LocalTangent(scenario.origin.lat, scenario.origin.lon, scenario.origin.alt)
    samples = [a.sample for a in arrivals if a.role == 'fix']
    time = np.array([sample.time_us - scenario.start_us for sample in samples]) * 1e-6
    places = np.array([tangent.to_enu(fix.lat, fix.lon, fix.alt) for fix in samples])
    return Track(time - FIX_DELAY, places)


def _fused(scenario: Scenario, replayed: Path) -> tuple[Track, Array]:
    """Return the fused track about the scenario's origin and its 1-sigma (N, 3) ENU."""
    summary = json.loads((replayed / 'summary.json').read_text(encoding='utf-8'))
    with (replayed / 'trajectory.csv').open(newline='', encoding='utf-8') as stream:
        rows = list(csv.DictReader(stream))
    if not rows or not summary.get('origin'):
        raise DemoError(f'{replayed} holds no fused track: see {replayed.parent / "replay.log"}')
    columns = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    origin = summary['origin']
    tangent = LocalTangent(scenario.origin.lat, scenario.origin.lon, scenario.origin.alt)
    shift = np.array(tangent.to_enu(origin['lat'], origin['lon'], origin['alt']))
    position = np.stack([columns[name] for name in 'xyz'], axis=1) + shift
    sigma = np.sqrt(np.stack([columns[f'var_{name}'] for name in 'xyz'], axis=1))
    return Track(columns['t'] - scenario.start_us * 1e-6, position), sigma


def _enu(positions: Array) -> Array:
    return np.array([swap_enu_ned(position) for position in positions])


def _print_table(scores: dict[int, Score]) -> None:
    print('\nRMS error against the truth in m, horizontal (3-D); ratio = fused to the better '
          'single source')
    print(f'{"seed":>8}  {"where":8}{"fused":>15}{"odometry only":>17}{"GPS only":>18}'
          f'{"ratio":>14}')
    for seed, score in scores.items():
        print(f'{seed:8d}  {"outside":8}{_columns(score.outside)}')
        print(f'{"":8}  {"outage":8}{_columns(score.inside)}')


def _columns(errors: Rms) -> str:
    def cell(pair: tuple[float, float]) -> str:
        return f'{pair[0]:8.2f} ({pair[1]:6.2f})'

    ratios = f'{errors.ratio(0):6.2f} ({errors.ratio(1):4.2f})'
    return f'{cell(errors.fused)} {cell(errors.odometry)} {cell(errors.gps)} {ratios}'


def _draw(flight: Comparison, seed: int, output: Path) -> str:
    try:
        from ekf_fusion_ros.analysis.plots import draw_comparison

        path = output / 'demo.png'
        draw_comparison(path, flight, f'Odometry and GPS fused, simulated flight, seed {seed}')
        return str(path)
    except ModuleNotFoundError as error:
        return f'not drawn ({error}); install the extra: plot'


if __name__ == '__main__':
    sys.exit(main())
