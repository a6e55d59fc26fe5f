"""Command line: python3 -m ekf_fusion_ros {fuser,replay,simulate,demo,report} ..."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
import sys

MODULES = {
    'fuser': ('ekf_fusion_ros.node.fusion_node', 'the ROS 2 node'),
    'replay': ('ekf_fusion_ros.replay.cli', 'fuse a recording faster than real time'),
    'simulate': ('ekf_fusion_ros.simulation.cli', 'write a simulated recording with its truth'),
    'demo': ('ekf_fusion_ros.simulation.demo', 'simulate, replay and compare with the truth'),
    'report': ('', 'not in this release'),
}
EXTRAS = {
    'rclpy': 'ros',
    'rosbags': 'replay',
    'tqdm': 'replay',
    'matplotlib': 'plot',
    'scipy': 'fast',
}
INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command named first; return its exit status, 2 where there is no such command."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments and arguments[0] in ('-h', '--help'):
        print(_usage())
        return 0
    if not arguments or arguments[0] not in MODULES:
        said = f'no command {arguments[0]!r}\n' if arguments else ''
        print(said + _usage(), file=sys.stderr)
        return 2
    return _run(arguments[0], arguments[1:])


def fuser() -> int:
    """Run the node (console script)."""
    return _run('fuser', sys.argv[1:])


def replay() -> int:
    """Fuse a recording (console script)."""
    return _run('replay', sys.argv[1:])


def simulate() -> int:
    """Write a simulated recording (console script)."""
    return _run('simulate', sys.argv[1:])


def report() -> int:
    """Say that reports come later (console script)."""
    return _run('report', sys.argv[1:])


def _run(command: str, arguments: list[str]) -> int:
    module, _ = MODULES[command]
    if not module:
        print(f'{command} is {MODULES[command][1]}: see summary.json of a replay', file=sys.stderr)
        return 2
    try:
        return int(import_module(module).main(arguments) or 0)
    except ModuleNotFoundError as error:
        missing = (error.name or '').partition('.')[0]
        if missing not in EXTRAS:
            raise
        print(_install_hint(command, missing), file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return INTERRUPTED


def _install_hint(command: str, missing: str) -> str:
    extra = EXTRAS[missing]
    return f"{command} needs {missing}: pip install 'ekf_fusion_ros[{extra}]'"


def _usage() -> str:
    lines = [f'  {name:<9} {words}' for name, (_, words) in MODULES.items()]
    return '\n'.join(['usage: python3 -m ekf_fusion_ros COMMAND ...', '', 'commands:', *lines])


if __name__ == '__main__':
    sys.exit(main())
