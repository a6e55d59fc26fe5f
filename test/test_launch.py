"""The launch file, with stand-ins for launch and launch_ros, which are in no wheel."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import runpy
import sys
from types import ModuleType
from types import SimpleNamespace
from typing import Any

import pytest

FILE = Path(__file__).resolve().parents[1] / 'launch' / 'fuser.launch.py'
Launch = Callable[..., dict[str, Any]]


class Configuration:
    """Gives the value of an argument, as launch's substitution does."""

    def __init__(self, name: str) -> None:
        self.name = name

    def perform(self, context: dict[str, str]) -> str:
        return context[self.name]


@pytest.fixture
def launch(monkeypatch: pytest.MonkeyPatch) -> Launch:
    """Return what launches the file with arguments and gives what it asks of the node."""
    def module(name: str, **members: Any) -> None:
        stand_in = ModuleType(name)
        vars(stand_in).update(members)
        monkeypatch.setitem(sys.modules, name, stand_in)

    def record(**keywords: Any) -> SimpleNamespace:
        return SimpleNamespace(**keywords)

    module('launch', LaunchDescription=list)
    module('launch.actions', DeclareLaunchArgument=lambda name, **rest: record(name=name, **rest),
           OpaqueFunction=record)
    module('launch.substitutions', LaunchConfiguration=Configuration)
    module('launch_ros')
    module('launch_ros.actions', Node=lambda **keywords: keywords)

    def launched(**arguments: str) -> dict[str, Any]:
        *declared, opaque = runpy.run_path(str(FILE))['generate_launch_description']()
        values = {argument.name: argument.default_value for argument in declared}
        assert set(arguments) <= set(values)
        (node,) = opaque.function({**values, **arguments})
        told: dict[str, Any] = node
        return told

    return launched


def test_without_arguments_the_node_starts_as_ros2_run_starts_it(launch: Launch) -> None:
    node = launch()
    assert (node['package'], node['executable'], node['name']) == (
        'ekf_fusion_ros', 'fuser', 'fuser')
    assert node['namespace'] == ''
    assert node['remappings'] == []
    assert node['parameters'] == [{'use_sim_time': False}]


def test_arguments_reach_the_node(launch: Launch) -> None:
    node = launch(odom='/vio/odometry', odometry_filtered='/mavros/odometry/out', namespace='uav1',
                  params_file='flight.yaml', use_sim_time='true', log_level='debug')
    assert node['remappings'] == [
        ('odom', '/vio/odometry'), ('odometry/filtered', '/mavros/odometry/out')]
    assert node['namespace'] == 'uav1'
    assert node['parameters'] == ['flight.yaml', {'use_sim_time': True}]
    assert node['arguments'] == ['--ros-args', '--log-level', 'debug']


def test_every_input_of_the_node_can_be_renamed(launch: Launch) -> None:
    pytest.importorskip('rclpy')
    from ekf_fusion_ros.node.inputs import TOPICS
    inputs = [topic for topic, _ in TOPICS.values()]
    node = launch(**{topic: f'/robot/{topic}' for topic in inputs})
    assert sorted(node['remappings']) == sorted(
        (topic, f'/robot/{topic}') for topic in inputs)


PRESETS = ('vins_fusion', 'openvins', 'isaac_visual_slam', 'rtabmap', 'zed', 'wheel_odometry',
           'mavros')


@pytest.mark.parametrize('name', PRESETS)
def test_a_preset_is_a_file_that_goes_before_the_users_own(launch: Launch, name: str) -> None:
    node = launch(preset=name, params_file='mine.yaml')
    file, *rest = node['parameters']
    assert Path(file).is_file()
    assert rest == ['mine.yaml', {'use_sim_time': False}]
    text = Path(file).read_text(encoding='utf-8')
    assert f'preset:={name}' in text


@pytest.mark.parametrize('name', PRESETS)
def test_the_command_in_a_preset_renames_topics_that_exist(launch: Launch, name: str) -> None:
    text = (FILE.parents[1] / 'config' / f'{name}.yaml').read_text(encoding='utf-8')
    comments = ' '.join(line.lstrip('# ') for line in text.split('/**:')[0].splitlines())
    arguments = dict(word.split(':=') for word in comments.split() if ':=' in word)
    assert {'preset', 'odom', 'fix'} <= set(arguments)
    assert len(launch(**arguments)['remappings']) == len(arguments) - 1
