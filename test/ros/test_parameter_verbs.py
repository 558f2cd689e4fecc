"""Every node's parameters as `ros2 param list`, `describe`, `dump`, `load` and `delete` ask for them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import rclpy
from rcl_interfaces.msg import ParameterType, SetParametersResult
from rclpy.parameter import Parameter

from advise_ros import config
from advise_ros.ros import introspection
from advise_ros.ros.configured import ConfiguredNode
from advise_ros.ros.private_domain import private_domain

SET_BEFORE_START = ('start_type_description_service',)


@pytest.fixture(name='nodes', scope='module')
def all_nodes() -> Iterator[dict[str, ConfiguredNode]]:
    """Each node with its parameters, and nothing else of it."""
    with private_domain() as domain:
        rclpy.init(args=[], domain_id=domain)
        nodes = {name: ConfiguredNode(name) for name in config.NODES}
        for name, node in nodes.items():
            node.load(config.NODES[name])
            introspection.configure(node)
        yield nodes
        for node in nodes.values():
            node.destroy_node()
        rclpy.try_shutdown()


def set_all(node: ConfiguredNode, parameters: list[Parameter]) -> list[SetParametersResult]:
    """One by one, as the service /NODE/set_parameters does."""
    return [node.set_parameters_atomically([one]) for one in parameters]


def names_of(node: ConfiguredNode) -> list[str]:
    return sorted(node.list_parameters([], 0).names)


@pytest.mark.parametrize('name', config.NODES)
def test_each_parameter_has_a_meaning_a_type_and_what_is_allowed(nodes: dict[str, ConfiguredNode], name: str) -> None:
    node = nodes[name]
    own = [one for one in names_of(node) if one not in ('use_sim_time', *SET_BEFORE_START)]
    assert set(config.defaults(config.NODES[name])) < set(own)
    for described in node.describe_parameters(own):
        assert described.description, described.name
        assert described.additional_constraints.startswith('allowed: '), described.name
        value = node.get_parameter(described.name)
        assert value.type_ != Parameter.Type.NOT_SET
        ranged = described.floating_point_range or described.integer_range
        assert not ranged or ranged[0].from_value <= value.value <= ranged[0].to_value
        kind = value.get_parameter_value().type
        assert not described.floating_point_range or kind == ParameterType.PARAMETER_DOUBLE
        assert not described.integer_range or kind == ParameterType.PARAMETER_INTEGER


@pytest.mark.parametrize('name', config.NODES)
def test_what_was_dumped_is_loaded_again_without_a_refusal(nodes: dict[str, ConfiguredNode], name: str) -> None:
    node = nodes[name]
    dumped = node.get_parameters(names_of(node))
    refused = [result.reason for result in set_all(node, dumped) if not result.successful]
    assert not refused
    assert [(one.name, one.value) for one in node.get_parameters(names_of(node))] == [(one.name, one.value) for one in dumped]


@pytest.mark.parametrize('name', config.NODES)
def test_no_parameter_is_deleted_and_an_unknown_one_has_a_sentence(nodes: dict[str, ConfiguredNode], name: str) -> None:
    own = next(iter(config.defaults(config.NODES[name])))
    (deleted,) = set_all(nodes[name], [Parameter(own, Parameter.Type.NOT_SET)])
    assert deleted.reason == f"parameter '{own}' cannot be deleted; set it to another value"
    (strange,) = set_all(nodes[name], [Parameter('nonsense', value=1)])
    assert "parameter 'nonsense' is unknown" in strange.reason


@pytest.mark.parametrize('read_only', SET_BEFORE_START)
def test_rclpys_own_parameters_are_not_changed_where_they_are_read_only(
    nodes: dict[str, ConfiguredNode], read_only: str,
) -> None:
    (result,) = set_all(nodes['policy'], [Parameter(read_only, value=False)])
    assert (result.successful, 'read-only' in result.reason) == (False, True)
