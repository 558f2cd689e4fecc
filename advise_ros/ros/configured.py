"""A node whose parameters are a dataclass of config.py: which may be set while it runs, and profiles that they override."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any, TypeVar

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription

from advise_ros import config
from advise_ros.core.errors import InputError
from advise_ros.ros import introspection, parameters
from advise_ros.ros.qos_overrides import PREFIX, QosOverrides

ConfigT = TypeVar('ConfigT')


class ConfiguredNode(Node):
    """What every node of the package does with parameters.

    Attributes:
        config: the parameters as they stand, of the class that `load` was given.
        opens_later: it opens topics as they appear, so an override of a profile may fit later.
    """

    config: Any = None
    opens_later = False
    _qos_overrides: QosOverrides | None = None

    def __init__(self, name: str) -> None:
        super().__init__(name)
        given = self._parameter_overrides  # rclpy has no public view of them
        self._qos_overrides = QosOverrides({key: one.value for key, one in given.items() if key.startswith(PREFIX)})

    # -- for subclasses ----------------------------------------------------------------------
    def load(self, config_class: type[ConfigT]) -> ConfigT:
        """Check what was given and declare the parameters.

        Raises:
            InputError: as parameters.load.
        """
        self.config = values = parameters.load(self, config_class)
        return values

    def changed(self, names: frozenset[str]) -> None:
        """Parameters that may be set while the node runs have other values now, in `config`."""

    @property
    def unconfigured(self) -> bool:
        """It reads its parameters yet: any may be set."""
        return False

    # -- set ---------------------------------------------------------------------------------
    def set_parameters_atomically(self, parameter_list: Sequence[Parameter]) -> SetParametersResult:
        """All or none, in our words; what has its value already is set."""
        try:
            wanted = [checked for one in parameter_list if (checked := self._parameter_to_set(one)) is not None]
        except InputError as refusal:
            self.get_logger().warning(f'not set: {refusal}')
            return SetParametersResult(successful=False, reason=str(refusal))
        result = super().set_parameters_atomically(wanted) if wanted else SetParametersResult(successful=True)
        if result.successful:
            for one in wanted:
                if one.name == introspection.PARAMETER:
                    introspection.publish_calls(self, one.value)
            self._take_parameters({one.name: one.value for one in wanted if self._is_own_parameter(one.name)})
        return result

    def _is_own_parameter(self, name: str) -> bool:
        return self.config is not None and any(spec.name == name for spec in fields(self.config))

    def _parameter_to_set(self, wanted: Parameter) -> Parameter | None:
        """What is to be set, in the type of its parameter; None if it is so already.

        Raises:
            InputError: it is unknown, not allowed, or not read any more.
        """
        name = wanted.name
        if not self._is_own_parameter(name):
            if name == introspection.PARAMETER:
                return Parameter(name, value=introspection.checked(wanted.value))
            if self.has_parameter(name):  # rclpy's own, of which some are read-only.
                return None if wanted.value == self.get_parameter(name).value else wanted
            known = tuple(spec.name for spec in fields(self.config)) if self.config is not None else ()
            raise InputError(config.unknown_name(name, known))
        if wanted.type_ == Parameter.Type.NOT_SET:
            raise InputError(f"parameter '{name}' cannot be deleted; set it to another value")
        (spec,) = (one for one in fields(self.config) if one.name == name)
        value = config.check(spec, wanted.value)
        if value == getattr(self.config, name):
            return None
        if not self._parameter_counts_yet(name):
            raise InputError(self._parameter_remedy(name))
        return Parameter(name, value=value)

    def _parameter_counts_yet(self, name: str) -> bool:
        kind = type(self.config)
        return name in config.live(kind) or (self.unconfigured and config.at_configure(kind, name))

    def _parameter_remedy(self, name: str) -> str:
        node = self.get_fully_qualified_name()
        if config.at_configure(type(self.config), name):
            return (
                f"parameter '{name}' is read at configure: ros2 lifecycle set {node} deactivate, then cleanup, set it, then "
                'configure and activate'
            )
        return f"parameter '{name}' is read at the start: start {node} again with -p {name}:=VALUE"

    def _take_parameters(self, new: dict[str, Any]) -> None:
        if not new:
            return
        before, self.config = self.config, replace(self.config, **new)
        live = frozenset(new) & config.live(type(self.config)).keys()
        for name, value in new.items():
            when = config.counts_from(type(self.config), name)
            self.get_logger().info(f"parameter '{name}' is {value!r} (was {getattr(before, name)!r}): {when}")
        if live and not self.unconfigured:
            self.changed(live)

    # -- profiles ----------------------------------------------------------------------------
    def create_publisher(self, msg_type: Any, topic: str, qos_profile: QoSProfile | int, **rest: Any) -> Publisher:
        """As rclpy's, by the profile that a parameter overrides."""
        profile, options = self._overridden(topic, 'publisher', qos_profile)
        return super().create_publisher(msg_type, topic, profile, qos_overriding_options=options, **rest)

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Callable[[Any], None], qos_profile: QoSProfile | int, **rest: Any,
    ) -> Subscription:
        """As rclpy's, by the profile that a parameter overrides."""
        profile, options = self._overridden(topic, 'subscription', qos_profile)
        return super().create_subscription(msg_type, topic, callback, profile, qos_overriding_options=options, **rest)

    def _overridden(
        self, topic: str, entity: str, profile: QoSProfile | int,
    ) -> tuple[QoSProfile | int, QoSOverridingOptions | None]:
        # What rclpy opens before it has read any parameter has no override.
        if self._qos_overrides is None or not self._qos_overrides.override(self.resolve_topic_name(topic), entity):
            return profile, None
        # rclpy writes into the profile that it is given, and that one is everybody's.
        own = QoSProfile(depth=profile) if isinstance(profile, int) else copy.copy(profile)
        return own, QoSOverridingOptions.with_default_policies()

    def check_overrides(self) -> None:
        """Look for overrides of profiles that fitted nothing, once all is open.

        Raises:
            InputError: there is one.
        """
        unused = self._qos_overrides.unused if self._qos_overrides is not None else ''
        if unused and not self.opens_later:
            raise InputError(unused)
