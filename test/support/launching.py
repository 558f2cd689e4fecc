"""The launch file without the `launch` packages, which are not on PyPI.

MOCK: small stand-ins for `launch` and `launch_ros` record what the file asks for. That a real
`ros2 launch` takes it is tried on a full ROS installation.
"""

from __future__ import annotations

import importlib.util
from types import ModuleType, SimpleNamespace
from typing import Any
from unittest import mock

from support.paths import ROOT


class Recorded(SimpleNamespace):
    """Stand-in for a launch class: keeps its arguments."""

    def __init__(self, *args: Any, **named: Any) -> None:
        super().__init__(args=args, name=args[0] if args else None, **named)


class Configuration(Recorded):
    def perform(self, context: dict[str, str]) -> str:
        return context[self.name]


CONTENTS: dict[str, dict[str, Any]] = {
    'launch': {'LaunchContext': dict, 'LaunchDescription': Recorded},
    'launch.actions': {'DeclareLaunchArgument': Recorded, 'OpaqueFunction': Recorded},
    'launch.substitutions': {'LaunchConfiguration': Configuration},
    'launch_ros': {},
    'launch_ros.actions': {'Node': Recorded},
    'launch_ros.parameter_descriptions': {'ParameterValue': lambda value, value_type: value_type(value)},
}


def launch_file(share: str = '/share/advise_ros') -> ModuleType:
    """The module launch/advise.launch.py over the stand-ins."""
    package = {'get_package_share_directory': lambda name: share}
    modules = {}
    for name, members in {**CONTENTS, 'ament_index_python.packages': package}.items():
        modules[name] = ModuleType(name)
        vars(modules[name]).update(members)
    spec = importlib.util.spec_from_file_location('advise_launch', ROOT / 'launch' / 'advise.launch.py')
    assert spec is not None
    assert spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    with mock.patch.dict('sys.modules', modules):
        spec.loader.exec_module(loaded)
    return loaded


def nodes(file: ModuleType, **given: str) -> dict[str, Recorded]:
    """Executable -> node for launch arguments as a user types them."""
    *arguments, opaque = file.generate_launch_description().args[0]
    values = {argument.name: argument.default_value for argument in arguments}
    assert set(given) <= set(values)
    return {node.executable: node for node in opaque.function({**values, **given})}
