"""Node parameters from the dataclasses of config.py."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import Field, fields
from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from advise_ros import config
from advise_ros.core.errors import InputError
from advise_ros.ros import introspection, params_files, qos_overrides

ConfigT = TypeVar('ConfigT')

# Parameters that rclpy declares by itself, and the one of introspection.py.
BUILT_IN = ('use_sim_time', 'start_type_description_service', introspection.PARAMETER)

# The process's own words, for what rclpy does not keep of them.
_files: list[params_files.ParamsFile] = []


def read_files(args: Sequence[str]) -> None:
    """Look at the files of parameters on the command line; before `load`."""
    _files[:] = params_files.named_in(args)


def _descriptor(config_class: type[Any], spec: Field[Any]) -> ParameterDescriptor:
    settable = spec.name in config.live(config_class) or config.at_configure(config_class, spec.name)
    descriptor = ParameterDescriptor(
        name=spec.name,
        description=spec.metadata['doc'],
        additional_constraints=f'allowed: {config.range_text(spec)}; {config.counts_from(config_class, spec.name)}',
        read_only=not settable,
        dynamic_typing=True,  # Wrong types are refused in one sentence.
    )
    low, high = spec.metadata['low'], spec.metadata['high']
    if low is not None and high is not None:
        if isinstance(spec.default, float):
            descriptor.floating_point_range = [FloatingPointRange(from_value=float(low), to_value=float(high))]
        else:
            descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high), step=1)]
    return descriptor


def load(node: Node, config_class: type[ConfigT]) -> ConfigT:
    """Check the overrides given to a node and declare every field as a parameter.

    Raises:
        InputError: an override is unknown, of the wrong type or out of range.
    """
    overrides = {
        name: parameter.value
        for name, parameter in node._parameter_overrides.items()  # rclpy has no public view of them
        if name not in BUILT_IN and not name.startswith(qos_overrides.PREFIX)
    }
    specs: Sequence[Field[Any]] = fields(config_class)  # type: ignore[arg-type]
    foreign = _meant_for_others(node, {spec.name for spec in specs})
    values = config.build(config_class, {name: value for name, value in overrides.items() if name not in foreign})
    for spec in specs:
        # The value is checked; declaring it with the override ignored keeps int -> float conversions.
        node.declare_parameter(spec.name, getattr(values, spec.name), _descriptor(config_class, spec), ignore_override=True)
    for file in _files:
        if remark := file.remark(node.get_fully_qualified_name(), config.NODES):
            node.get_logger().warning(remark)
    return values


def _meant_for_others(node: Node, own: set[str]) -> set[str]:
    """Parameters of other nodes of the package, below a key that means nodes of any name."""
    name = node.get_fully_qualified_name()
    general = {key for file in _files for entry in file.fitting(name) if entry.general for key in entry.values}
    of_others = {spec.name for config_class in config.NODES.values() for spec in fields(config_class)}
    return (general & of_others) - own


@contextmanager
def blamed(name: str) -> Iterator[None]:
    """What is wrong within is wrong with this parameter.

    Raises:
        InputError: the one from within, with the parameter's name before it.
    """
    try:
        yield
    except InputError as problem:
        raise InputError(f"parameter '{name}': {problem}") from problem


def as_text(values: object) -> dict[str, str]:
    """Name -> value as text, for logs and bags."""
    return {spec.name: str(getattr(values, spec.name)) for spec in fields(values)}  # type: ignore[arg-type]
