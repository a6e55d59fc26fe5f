"""Command line of the replay: arguments to ReplayOptions, errors to one sentence."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import field
from dataclasses import replace
import math
import os
from pathlib import Path
import sys

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import load_file
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.replay.options import ReplayOptions
from ekf_fusion_ros.replay.runner import replay
from ekf_fusion_ros.replay.side_by_side import replay_side_by_side
from ekf_fusion_ros.replay.storage import RecordingError
from ekf_fusion_ros.roles import SUPPORTED

DONE, UNUSABLE, WRONG_ARGUMENTS = 0, 1, 2
EXAMPLES = """
examples:
  replay flight/ --output out
  replay flight.mcap --output out --topic imu=/imu/data --topic magnetic_field=
  replay flight/ --output out --withhold fix=60:80,120:140 --set ekf2.gnss.delay_ms=200
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run a replay; return 0 done, 1 the recording could not be used, 2 wrong arguments.

    Also 1, without a word, where nobody reads what is said any more, as after `| head -3`.
    """
    try:
        status = _status(argv)
        # What waits in the buffer would otherwise fail after the last chance to catch it.
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return UNUSABLE
    return status


def _status(argv: Sequence[str] | None) -> int:
    try:
        arguments = _parser().parse_args(argv)
    except SystemExit as stop:
        return WRONG_ARGUMENTS if stop.code else DONE
    try:
        _run(_options(arguments), arguments.estimator)
    except RecordingError as error:
        return _fail(str(error), UNUSABLE)
    except ValueError as error:
        return _fail(str(error), WRONG_ARGUMENTS)
    except BrokenPipeError:
        raise
    except OSError as error:
        reason = error.strerror or str(error) or type(error).__name__
        return _fail(f'{error.filename or arguments.output}: {reason}', UNUSABLE)
    return DONE


def _run(options: ReplayOptions, estimators: str | None) -> None:
    """Replay once, or once with each of several estimators."""
    names = [name.strip() for name in (estimators or options.params.estimator).split(',')]
    if len(set(names)) < len(names):
        raise ValueError(f'--estimator {estimators}: each name once')
    if len(names) > 1:
        replay_side_by_side(options, names)
    else:
        replay(replace(options, params=with_overrides(options.params, {'estimator': names[0]})))


def _fail(sentence: str, status: int) -> int:
    print(f'replay: {sentence}', file=sys.stderr)
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='replay', description='Fuse a recording faster than real time.', epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add('recording', type=Path,
        help='rosbag2 folder, .mcap, .db3 (plain or zstd), or sensor CSV (.csv, .csv.gz)')
    add('--output', type=Path, required=True, metavar='DIR', help='folder for the results')
    add('--params', type=Path, action='append', default=[], metavar='FILE',
        help='ROS 2 YAML, PX4 .params or .ulg, or ECL params.txt; several in order')
    add('--set', action='append', default=[], metavar='NAME=VALUE', dest='overrides',
        help='one parameter by its dotted name; after all files')
    add('--topic', action='append', default=[], metavar='ROLE=/NAME', dest='topics',
        help=f'topic of a role, empty to keep the role out; roles: {", ".join(SUPPORTED)}')
    add('--start', type=_seconds, default=0.0, metavar='S',
        help='begin S seconds after the start of the recording')
    add('--end', type=_seconds, metavar='S', help='end S seconds after the start')
    add('--withhold', action='append', default=[], metavar='ROLE=S:E[,S:E...]',
        help='keep messages of a role from the filter in windows of stamps, in seconds after '
        'the start; fix withholds fix_velocity and gps_heading too, fix_2 fix_velocity_2, '
        'fix_3 fix_velocity_3')
    add('--estimator', metavar='NAME[,NAME...]',
        help='estimator in place of the parameter; several run one after the other, each into a '
        'folder of its name, and are compared')
    add('--rate', type=float, metavar='HZ', help='rate of the outputs; 0 = every filter update')
    add('--log-states', action='store_true', help='write estimator.csv, a row a filter update')
    add('--no-bag', action='store_true', help='do not write the fused bag')
    return parser


def _options(arguments: argparse.Namespace) -> ReplayOptions:
    """Return what the arguments ask for; raises ValueError with one sentence."""
    if arguments.end is not None and arguments.end <= arguments.start:
        raise ValueError(f'--end {arguments.end:g} is not after --start {arguments.start:g}')
    loaded = _params(arguments.params, arguments.overrides)
    params = loaded.params
    if arguments.rate is not None:
        params = with_overrides(params, {'session.output_rate': arguments.rate})
    return ReplayOptions(
        recording=arguments.recording,
        output=arguments.output,
        params=params,
        topics=_topics(arguments.topics),
        start=arguments.start,
        end=arguments.end,
        withhold=_windows(arguments.withhold),
        log_states=arguments.log_states,
        write_bag=not arguments.no_bag,
        progress=True,
        vehicle=loaded.vehicle,
    )


@dataclass(frozen=True, slots=True)
class _Loaded:
    params: Params
    vehicle: dict[str, object] = field(default_factory=dict)


def _params(files: Sequence[Path], overrides: Sequence[str]) -> _Loaded:
    loaded = _Loaded(Params())
    for path in files:
        found = load_file(path, loaded.params)
        loaded = replace(loaded, params=found.params, vehicle=loaded.vehicle | found.vehicle)
        if found.unused:
            print(f'{path}: not used: {", ".join(found.unused)}')
    values = dict(_pair(text, '--set', 'name=value') for text in overrides)
    return replace(loaded, params=with_overrides(loaded.params, values))


def _pair(text: str, option: str, form: str) -> tuple[str, str]:
    name, equals, value = text.partition('=')
    if not equals or not name.strip():
        raise ValueError(f'{option} {text}: expected {form}')
    return name.strip(), value.strip()


def _topics(texts: Sequence[str]) -> dict[str, str]:
    topics: dict[str, str] = {}
    for text in texts:
        role, name = _pair(text, '--topic', 'role=/name, or role= to keep the role out')
        _check_role(role, '--topic')
        if role in topics:
            raise ValueError(f'--topic {text}: role {role} is given twice')
        topics[role] = name
    return topics


def _windows(texts: Sequence[str]) -> dict[str, list[tuple[float, float]]]:
    windows: dict[str, list[tuple[float, float]]] = {}
    for text in texts:
        role, spans = _pair(text, '--withhold', 'role=S:E[,S:E...]')
        _check_role(role, '--withhold')
        for span in spans.split(','):
            first, _, end = span.partition(':')
            try:
                pair = float(first), float(end)
            except ValueError:
                raise ValueError(f'--withhold {text}: {span!r} is not a window S:E') from None
            if not pair[0] < pair[1]:
                raise ValueError(f'--withhold {text}: the window {span} ends before it begins')
            windows.setdefault(role, []).append(pair)
    return windows


def _check_role(role: str, option: str) -> None:
    if role not in SUPPORTED:
        raise ValueError(f'{option}: unknown role {role!r}; choose of {", ".join(SUPPORTED)}')


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value < 0:
        raise argparse.ArgumentTypeError(f'{text} is not a number of seconds from 0 on')
    return value


if __name__ == '__main__':
    sys.exit(main())
