"""Declares the fields of a configuration as ROS parameters and reads their values back, checked."""

from __future__ import annotations

import sys
from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from ros_scenesense.parameters import Parameter, build, parameters_of

Configuration = TypeVar("Configuration")
_LARGEST_INTEGER = 2**63 - 1


def declare_configuration(node: Node, configuration: type[Configuration]) -> Configuration:
    """Declares every parameter of a configuration, read-only since it is set at start alone.

    Args:
        node: Gets the parameters; what its params file or command line says is used.
        configuration: Dataclass whose fields are `parameter`s.

    Raises:
        ParameterError: If a value is wrong.
    """
    declared = parameters_of(configuration)
    given = {parameter.name: _given_value(node, parameter) for parameter in declared}
    values = build(configuration, given)
    for parameter in declared:
        value = getattr(values, parameter.name)
        node.declare_parameter(
            parameter.name, value, descriptor_of(parameter), ignore_override=True
        )
    return values


def descriptor_of(parameter: Parameter) -> ParameterDescriptor:
    """The descriptor that `ros2 param describe` shows: meaning, allowed values, read-only."""
    descriptor = ParameterDescriptor(
        description=parameter.description,
        additional_constraints=f"must be {parameter.allowed}; set at start only",
        read_only=True,
    )
    low, high = parameter.minimum, parameter.maximum
    if low is None and high is None:
        return descriptor
    if parameter.type is float:
        bounds = FloatingPointRange(
            from_value=-sys.float_info.max if low is None else float(low),
            to_value=sys.float_info.max if high is None else float(high),
        )
        descriptor.floating_point_range = [bounds]
    if parameter.type is int:
        steps = IntegerRange(
            from_value=-_LARGEST_INTEGER if low is None else int(low),
            to_value=_LARGEST_INTEGER if high is None else int(high),
            step=1,
        )
        descriptor.integer_range = [steps]
    return descriptor


def _given_value(node: Node, parameter: Parameter) -> Any:
    # rclpy answers a double given as `5`, or a value out of range, with a traceback. So it takes
    # any value at first, and the check with its one clear line is ours.
    anything = ParameterDescriptor(dynamic_typing=True)
    value = node.declare_parameter(parameter.name, parameter.default, anything).value
    node.undeclare_parameter(parameter.name)
    return value
