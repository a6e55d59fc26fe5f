"""Parameters of the node: declared from the dataclasses, described, refused in one sentence."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterator
from typing import Any

import pytest

rclpy = pytest.importorskip('rclpy')

from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.node import Node
from rclpy.parameter import Parameter

from ekf_fusion_ros.node.parameters import constraints
from ekf_fusion_ros.node.parameters import declare_parameters
from ekf_fusion_ros.params.spec import ParamSpec
from ekf_fusion_ros.params.spec import leaves
from ekf_fusion_ros.params.tree import Params

MakeNode = Callable[..., Node]


@pytest.fixture
def make_node() -> Iterator[MakeNode]:
    """Make nodes with parameters as if given on the command line."""
    context = rclpy.Context()
    rclpy.init(context=context)
    nodes: list[Node] = []

    def make(**values: Any) -> Node:
        overrides = [Parameter(name.replace('__', '.'), value=value)
                     for name, value in values.items()]
        nodes.append(Node(
            'parameters_test', context=context, parameter_overrides=overrides,
            automatically_declare_parameters_from_overrides=True))
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown(context=context)


def test_every_leaf_is_declared_with_its_default(make_node: MakeNode) -> None:
    node = make_node()
    assert declare_parameters(node) == Params()
    for name, value, _ in leaves(Params()):
        declared = node.get_parameter(name).value
        assert (tuple(declared) if isinstance(value, tuple) else declared) == value, name


def test_descriptors_carry_words_range_and_unit(make_node: MakeNode) -> None:
    node = make_node()
    declare_parameters(node)
    delay = node.describe_parameter('ekf2.gnss.delay_ms')
    assert delay.description
    assert delay.additional_constraints.endswith('fixed while the node runs')
    assert (delay.floating_point_range[0].from_value, delay.floating_point_range[0].step) == (0, 0)
    assert delay.floating_point_range[0].to_value > 100
    assert 'unit: ms' in delay.additional_constraints
    assert 'PX4: EKF2_GPS_DELAY' in delay.additional_constraints
    limit = node.describe_parameter('node.queue_limit')
    assert limit.integer_range[0].from_value == 10
    kinds = node.describe_parameter('node.fix_velocity_type').additional_constraints
    assert kinds == 'one of: twist_with_covariance, twist; fixed while the node runs'
    assert 'fixed' not in node.describe_parameter('ekf2.gnss.pos_gate').additional_constraints


def test_every_parameter_has_words(make_node: MakeNode) -> None:
    node = make_node()
    declare_parameters(node)
    for name, _, _ in leaves(Params()):
        assert node.describe_parameter(name).description, name


def test_one_sided_limit_is_said_in_words() -> None:
    assert constraints(ParamSpec('words', unit='m', min=0, live=True)) == 'unit: m; at least 0'


def test_given_values_arrive_and_integers_serve_as_numbers(make_node: MakeNode) -> None:
    node = make_node(ekf2__gnss__delay_ms=90, node__use_imu=True, ekf2__imu__position=[1, 0, 2])
    params = declare_parameters(node)
    assert params.ekf2.gnss.delay_ms == 90.0
    assert params.node.use_imu is True
    assert params.ekf2.imu.position == (1.0, 0.0, 2.0)
    assert node.get_parameter('ekf2.gnss.delay_ms').type_ == Parameter.Type.DOUBLE


@pytest.mark.parametrize(('values', 'words'), [
    ({'ekf2__gnss__delay_ms': -5.0}, ['ekf2.gnss.delay_ms', '-5', 'at least 0']),
    ({'ekf2__gnss__delay_ms': float('nan')}, ['ekf2.gnss.delay_ms', 'finite']),
    ({'ekf2__gnss__delay': 5.0}, ['unknown parameter ekf2.gnss.delay', 'ekf2.gnss.delay_ms']),
    ({'node__use_imu': 'maybe'}, ['node.use_imu', 'true or false']),
    ({'node__fix_velocity_type': 'pose'}, ['node.fix_velocity_type', 'twist_with_covariance']),
])
def test_bad_values_are_refused_in_one_sentence(
    make_node: MakeNode, values: dict[str, Any], words: list[str],
) -> None:
    with pytest.raises(ValueError) as refusal:
        declare_parameters(make_node(**values))
    assert '\n' not in str(refusal.value)
    for word in words:
        assert word in str(refusal.value)


def test_ros_own_parameters_are_not_ours(make_node: MakeNode) -> None:
    node = make_node(use_sim_time=True)
    node_params = declare_parameters(node)
    assert node_params == Params()
    assert node.get_parameter('use_sim_time').value is True



def test_unknown_names_stay_unknown(make_node: MakeNode) -> None:
    node = make_node()
    declare_parameters(node)
    with pytest.raises(ParameterNotDeclaredException):
        node.get_parameter('ekf2.nothing')
