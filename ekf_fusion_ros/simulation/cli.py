"""Command line: write a simulated recording and its truth."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from collections.abc import Mapping
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
import sys

from ekf_fusion_ros.simulation.scenario import FURTHER_RECEIVERS
from ekf_fusion_ros.simulation.scenario import FURTHER_ROLES
from ekf_fusion_ros.simulation.scenario import GPS_HEADING
from ekf_fusion_ros.simulation.scenario import ROLES
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.sensor import Window
from ekf_fusion_ros.simulation.surroundings import Wind
from ekf_fusion_ros.simulation.trajectory import Circle
from ekf_fusion_ros.simulation.trajectory import Drive
from ekf_fusion_ros.simulation.trajectory import FigureOfEight
from ekf_fusion_ros.simulation.trajectory import Flight
from ekf_fusion_ros.simulation.trajectory import Hover
from ekf_fusion_ros.simulation.trajectory import Loiter
from ekf_fusion_ros.simulation.trajectory import Trajectory
from ekf_fusion_ros.simulation.truth_file import write_truth

TRAJECTORIES: Mapping[str, Callable[[float], Trajectory]] = {
    'hover': lambda duration: Hover(duration=duration),
    'circle': lambda duration: Circle(duration=duration),
    'eight': lambda duration: FigureOfEight(duration=duration),
    'drive': lambda duration: Drive(duration=duration, stops=((40.0, 55.0),)),
    'flight': lambda duration: Flight(duration=duration),
    'loiter': lambda duration: Loiter(duration=duration),
}
KNOWN_ROLES = (*ROLES, *FURTHER_ROLES, GPS_HEADING, *FURTHER_RECEIVERS)


def main(argv: Sequence[str] | None = None) -> int:
    """Write a recording; return 0, 1 where it could not be written, 2 for wrong arguments."""
    try:
        options = _parser().parse_args(argv)
        scenario = _scenario(options)
    except SystemExit as stop:
        return int(stop.code or 0)
    except ValueError as error:
        print(f'simulate: {error}', file=sys.stderr)
        return 2
    try:
        # Only writing needs the bag library.
        from ekf_fusion_ros.replay.recording import write_recording

        options.output.mkdir(parents=True, exist_ok=True)
        recording = options.output / 'recording'
        if recording.exists():
            raise FileExistsError(f'{recording} exists: choose another folder')
        counts = write_recording(recording, scenario.arrivals())
        write_truth(options.output / 'truth.csv', scenario)
    except (OSError, ModuleNotFoundError) as error:
        print(f'simulate: {error}', file=sys.stderr)
        return 1
    for topic, count in sorted(counts.items()):
        print(f'{topic:18s} {count:8d} messages')
    print(f'recording: {recording}\ntruth:     {options.output / "truth.csv"}')
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='simulate', description='Write a simulated rosbag2 recording and its truth.')
    parser.add_argument('output', type=Path, help='folder for recording/ and truth.csv')
    parser.add_argument('--trajectory', choices=sorted(TRAJECTORIES), default='flight')
    parser.add_argument('--duration', type=float, default=180.0, metavar='S')
    parser.add_argument('--seed', type=int, default=0, help='of all random errors')
    parser.add_argument('--roles', default=','.join(ROLES), metavar='ROLE,...',
                        help='sensors on board (default: %(default)s; further ones: '
                        f'{", ".join(KNOWN_ROLES[len(ROLES):])})')
    parser.add_argument('--wind', default='0,0', metavar='N,E',
                        help='where the air goes, north and east in m/s')
    parser.add_argument('--outage', action='append', default=[], metavar='ROLE=S:E[,S:E...]',
                        help='windows without messages of a role, s from the start')
    return parser


def _scenario(options: argparse.Namespace) -> Scenario:
    if not 0.0 < options.duration <= 7200.0:
        raise ValueError(f'--duration {options.duration:g}: choose 0 to 7200 s')
    if options.seed < 0:
        raise ValueError(f'--seed {options.seed}: must not be negative')
    roles = [role for role in options.roles.split(',') if role]
    for role in roles:
        if role not in KNOWN_ROLES:
            raise ValueError(f'--roles {role}: choose from {", ".join(KNOWN_ROLES)}')
    sensors = default_sensors(roles)
    for text in options.outage:
        role, windows = _outage(text)
        if role not in sensors:
            raise ValueError(f'--outage {text}: {role!r} is not one of the roles on board')
        sensors[role] = replace(sensors[role], outages=windows)
    trajectory = replace(
        TRAJECTORIES[options.trajectory](options.duration), wind=_wind(options.wind))
    return Scenario(trajectory=trajectory, sensors=sensors, seed=options.seed)


def _wind(text: str) -> Wind:
    try:
        north, east = (float(word) for word in text.split(','))
    except ValueError:
        raise ValueError(f'--wind {text}: write NORTH,EAST in m/s, for example 3,-2') from None
    return Wind(mean=(north, east, 0.0))


def _outage(text: str) -> tuple[str, tuple[Window, ...]]:
    role, _, windows = text.partition('=')
    try:
        pairs = [window.split(':') for window in windows.split(',')]
        return role, tuple((float(begin), float(end)) for begin, end in pairs)
    except ValueError:
        raise ValueError(f'--outage {text}: write ROLE=START:END, for example fix=60:90') from None


if __name__ == '__main__':
    sys.exit(main())
