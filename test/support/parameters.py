"""Parameters of running nodes, as `ros2 param` asks for and sets them."""

from __future__ import annotations

from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.parameter import Parameter, parameter_value_to_python

from support.graph import Graph


def try_parameter(graph: Graph, node: str, name: str, value: Any) -> SetParametersResult:
    """What setting it comes to."""
    wanted = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    return graph.call(SetParameters, f'{node}/set_parameters', wanted).results[0]


def set_parameter(graph: Graph, node: str, name: str, value: Any) -> None:
    result = try_parameter(graph, node, name, value)
    assert result.successful, result.reason


def parameter(graph: Graph, node: str, name: str) -> Any:
    (value,) = graph.call(GetParameters, f'{node}/get_parameters', GetParameters.Request(names=[name])).values
    return parameter_value_to_python(value)


def described(graph: Graph, node: str, name: str) -> ParameterDescriptor:
    return graph.call(DescribeParameters, f'{node}/describe_parameters', DescribeParameters.Request(names=[name])).descriptors[0]
