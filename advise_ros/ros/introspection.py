"""Services that publish their calls: requests and responses as messages on `<service>/_service_event`."""

from __future__ import annotations

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.service_introspection import ServiceIntrospectionState

from advise_ros.core.errors import InputError

PARAMETER, OFF = 'service_introspection', 'off'
STATES = {
    'off': ServiceIntrospectionState.OFF, 'metadata': ServiceIntrospectionState.METADATA,
    'contents': ServiceIntrospectionState.CONTENTS,
}  # fmt: skip
EVENTS = QoSProfile(depth=100)
# Services of rclpy's own, below the node's name.
OF_RCLPY = ('parameters', 'parameter_types', 'type_description', '_state', '_states', '_transitions', '_transition_graph')
DESCRIPTION = 'what the services of this node publish of each call: nothing, when and by whom, or all of it'


def configure(node: Node) -> None:
    """Declare the parameter and do as it says, for the services that the node has by now but those of rclpy's own.

    Raises:
        InputError: the parameter is none of off, metadata and contents.
    """
    descriptor = ParameterDescriptor(
        name=PARAMETER, description=DESCRIPTION, additional_constraints=f'allowed: {", ".join(STATES)}; at once',
        dynamic_typing=True,
    )
    wanted = checked(node.declare_parameter(PARAMETER, OFF, descriptor).value)
    if wanted != OFF:
        publish_calls(node, wanted)


def checked(wanted: object) -> str:
    """The parameter's value.

    Raises:
        InputError: it is none of off, metadata and contents.
    """
    wanted = OFF if wanted is False else wanted  # YAML reads off as a truth value.
    if wanted not in STATES:
        raise InputError(f'parameter {PARAMETER!r} is {wanted!r}; allowed: {", ".join(STATES)}')
    return str(wanted)


def publish_calls(node: Node, wanted: str) -> None:
    """Publish so much of the calls from now on.

    Args:
        node: whose services are meant.
        wanted: off, metadata or contents.
    """
    own = f'{node.get_fully_qualified_name()}/'
    for service in node.services:
        name = service.service_name
        if not name.startswith(own) or not name.endswith(OF_RCLPY):
            service.configure_introspection(node.get_clock(), EVENTS, STATES[wanted])
