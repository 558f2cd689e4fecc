"""Node parameters from the dataclasses of config.py."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import Field, fields
from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from advise_ros import config
from advise_ros.ros import introspection

ConfigT = TypeVar('ConfigT')

# Parameters that rclpy declares by itself, and the one of introspection.py.
BUILT_IN = ('use_sim_time', 'start_type_description_service', introspection.PARAMETER)


def _descriptor(spec: Field[Any]) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(
        name=spec.name,
        description=spec.metadata['doc'],
        additional_constraints=f'allowed: {config.range_text(spec)}',
        read_only=True,
        dynamic_typing=True,  # Wrong types are refused below, in one sentence.
    )
    low, high = spec.metadata['low'], spec.metadata['high']
    if low is not None and high is not None:
        if isinstance(spec.default, float):
            descriptor.floating_point_range = [FloatingPointRange(from_value=float(low), to_value=float(high))]
        else:
            descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high), step=1)]
    return descriptor


def load(node: Node, config_class: type[ConfigT]) -> ConfigT:
    """Check the overrides given to a node and declare every field as a read-only parameter.

    Raises:
        InputError: an override is unknown, of the wrong type or out of range.
    """
    overrides = {
        name: parameter.value
        for name, parameter in node._parameter_overrides.items()  # rclpy has no public view of them
        if name not in BUILT_IN and not name.startswith('qos_overrides.')
    }
    specs: Sequence[Field[Any]] = fields(config_class)  # type: ignore[arg-type]
    values = config.build(config_class, overrides)
    for spec in specs:
        # The value is checked; declaring it with the override ignored keeps int -> float conversions.
        node.declare_parameter(spec.name, getattr(values, spec.name), _descriptor(spec), ignore_override=True)
    return values


def as_text(values: object) -> dict[str, str]:
    """Name -> value as text, for logs and bags."""
    return {spec.name: str(getattr(values, spec.name)) for spec in fields(values)}  # type: ignore[arg-type]
