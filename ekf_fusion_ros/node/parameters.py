"""ROS parameters from the parameter dataclasses."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping
from collections.abc import Sequence
from typing import Any

from rcl_interfaces.msg import FloatingPointRange
from rcl_interfaces.msg import IntegerRange
from rcl_interfaces.msg import ParameterDescriptor
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from ekf_fusion_ros.live.tuning import Tuning
from ekf_fusion_ros.node.guard import INTERNAL_ERROR
from ekf_fusion_ros.node.guard import Guard
from ekf_fusion_ros.params.spec import ParamSpec
from ekf_fusion_ros.params.spec import leaves
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.params.tree import with_overrides

# Parameters that ROS 2 and its libraries give to every node.
ROS_PARAMETERS = ('use_sim_time', 'start_type_description_service')
ROS_PREFIXES = ('qos_overrides.', 'diagnostic_updater.')


def declare_parameters(node: Node) -> Params:
    """Declare every parameter on a node and return the tree with the user's values.

    The node must have been created with `automatically_declare_parameters_from_overrides`: only
    so are misspelt names seen. Raises ValueError, naming the parameter, for an unknown name, a
    wrong type or a value out of range.
    """
    given = given_values(node)
    params = with_overrides(Params(), given)
    for name in given:
        node.undeclare_parameter(name)
    for name, value, spec in leaves(params):
        node.declare_parameter(name, value, describe(spec, value), ignore_override=True)
    return params


def accept_changes(node: Node, tuning: Tuning, guard: Guard) -> None:
    """Let live parameters be changed from now on; what is refused comes back with a reason.

    Others are not read-only to ROS, which would refuse them without saying why.
    """
    def judge(parameters: Sequence[Parameter]) -> SetParametersResult:
        try:
            refusal = tuning.obstacle(own_values(parameters))
        except Exception as error:  # nothing may leave a callback
            guard.tell('a change of parameters', error)
            refusal = INTERNAL_ERROR
        return SetParametersResult(successful=not refusal, reason=refusal)

    def change_of_parameters(parameters: Sequence[Parameter]) -> None:
        tuning.change(own_values(parameters))

    node.add_on_set_parameters_callback(judge)
    node.add_post_set_parameters_callback(guard(change_of_parameters))


def own_values(parameters: Iterable[Parameter]) -> dict[str, Any]:
    """Return the values of our own parameters by name."""
    return {one.name: one.value for one in parameters if is_own(one.name)}


def is_own(name: str) -> bool:
    """Return whether a parameter is one of ours, not one that ROS gives to every node."""
    return name not in ROS_PARAMETERS and not name.startswith(ROS_PREFIXES)


def given_values(node: Node) -> Mapping[str, Any]:
    """Return the values the user set by file or command line, by dotted name."""
    return {
        name: parameter.value
        for name, parameter in node.get_parameters_by_prefix('').items()
        if is_own(name)
    }


def describe(spec: ParamSpec, value: Any) -> ParameterDescriptor:
    """Return the descriptor: words, range and what a range cannot express."""
    descriptor = ParameterDescriptor(
        description=spec.description, additional_constraints=constraints(spec))
    if spec.min is None or spec.max is None or isinstance(value, bool):
        return descriptor
    if isinstance(value, int):
        descriptor.integer_range = [
            IntegerRange(from_value=int(spec.min), to_value=int(spec.max), step=1)]
    elif isinstance(value, float):
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=float(spec.min), to_value=float(spec.max), step=0.0)]
    return descriptor


def constraints(spec: ParamSpec) -> str:
    """Say in words the unit, the choices, one-sided limits, the PX4 name, and what is fixed."""
    words = []
    if spec.unit:
        words.append(f'unit: {spec.unit}')
    if spec.choices:
        words.append(f'one of: {", ".join(spec.choices)}')
    if spec.min is not None and spec.max is None:
        words.append(f'at least {spec.min:g}')
    if spec.max is not None and spec.min is None:
        words.append(f'at most {spec.max:g}')
    if spec.px4:
        words.append(f'PX4: {spec.px4}')
    if not spec.live:
        words.append('fixed while the node runs')
    return '; '.join(words)
