"""Start the node `fuser`.

ros2 launch ekf_fusion_ros fuser.launch.py odom:=/vio/odometry fix:=/gps/fix

Every topic can be renamed by an argument of its name; --show-args lists them.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.actions import OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

TOPICS = (
    'odom', 'fix', 'imu', 'fix_velocity', 'mag', 'pressure', 'range', 'flow', 'airspeed', 'landed',
    'armed', 'gps_heading', 'aux_velocity', 'fix_2', 'fix_velocity_2', 'fix_3', 'fix_velocity_3',
    'odometry/filtered', 'odometry/gps', 'gps/filtered')

ARGUMENTS = {
    'preset': ('', 'File of config/ for a source of odometry, without .yaml: vins_fusion, '
               'openvins, isaac_visual_slam, rtabmap, zed, wheel_odometry, mavros.'),
    'params_file': ('', 'ROS 2 YAML with parameters; config/default.yaml lists all of them.'),
    'namespace': ('', 'Namespace of the node and of its topics.'),
    'use_sim_time': ('false', 'Take timers from /clock; stamps of messages count either way.'),
    'log_level': ('info', 'debug, info, warn, error or fatal.'),
}


def argument_of(topic):
    """Return the name of the argument that renames a topic; a slash cannot be in one."""
    return topic.replace('/', '_')


def preset(name):
    """Return the file of a preset, which lies beside the folder of this one."""
    return Path(__file__).resolve().parents[1] / 'config' / f'{name}.yaml'


def start(context):
    """Return the node as the arguments want it."""
    value = {name: LaunchConfiguration(name).perform(context)
             for name in (*ARGUMENTS, *map(argument_of, TOPICS))}
    parameters = [str(preset(value['preset']))] if value['preset'] else []
    if value['params_file']:
        parameters.append(value['params_file'])
    parameters.append({'use_sim_time': value['use_sim_time'].lower() in ('true', '1')})
    renamed = [(topic, value[argument_of(topic)]) for topic in TOPICS]
    return [Node(
        package='ekf_fusion_ros',
        executable='fuser',
        name='fuser',
        namespace=value['namespace'],
        output='screen',
        parameters=parameters,
        remappings=[(topic, name) for topic, name in renamed if name != topic],
        arguments=['--ros-args', '--log-level', value['log_level']],
    )]


def generate_launch_description():
    """Return the arguments and the node."""
    described = dict(ARGUMENTS)
    for topic in TOPICS:
        described[argument_of(topic)] = (topic, f'Name of the topic {topic}.')
    declared = [DeclareLaunchArgument(name, default_value=default, description=text)
                for name, (default, text) in described.items()]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])
