"""The launch file without the `launch` packages, which are not on PyPI.

MOCK: small stand-ins for `launch` and `launch_ros` record what the file asks for. Where the real ones are installed,
`refusal` takes those.
"""

from __future__ import annotations

import contextlib
import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from unittest import mock

from support.paths import ROOT


class Recorded(SimpleNamespace):
    """Stand-in for a launch class: keeps its arguments."""

    def __init__(self, *args: Any, **named: Any) -> None:
        super().__init__(args=args, name=args[0] if args else None, **named)


class Configuration(Recorded):
    def perform(self, context: Context) -> str:
        return context.launch_configurations[self.name]


class Context(SimpleNamespace):
    """Stand-in for a LaunchContext."""

    launch_configurations: dict[str, str]
    is_shutdown = False


CONTENTS: dict[str, dict[str, Any]] = {
    'launch': {'LaunchContext': Context, 'LaunchDescription': Recorded},
    'launch.actions': dict.fromkeys(
        ('DeclareLaunchArgument', 'GroupAction', 'IncludeLaunchDescription', 'LogInfo', 'OpaqueFunction', 'Shutdown'), Recorded,
    ),
    'launch.launch_description_sources': {'PythonLaunchDescriptionSource': Recorded},
    'launch.substitutions': {
        'LaunchConfiguration': Configuration, 'PythonExpression': Recorded, 'ThisLaunchFileDir': Recorded,
    },
    'launch_ros': {},
    'launch_ros.actions': {'Node': Recorded},
    'launch_ros.parameter_descriptions': {'ParameterValue': lambda value, value_type: value_type(value)},
}


def launch_file(share: str = str(ROOT), name: str = 'advise') -> ModuleType:
    """The module launch/NAME.launch.py over the stand-ins."""
    package = {'get_package_share_directory': lambda name: share}
    modules = {}
    for module, members in {**CONTENTS, 'ament_index_python.packages': package}.items():
        modules[module] = ModuleType(module)
        vars(modules[module]).update(members)
    spec = importlib.util.spec_from_file_location(f'{name}_launch', ROOT / 'launch' / f'{name}.launch.py')
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
    context = Context(launch_configurations={**values, **given})
    return {node.executable: node for node in opaque.function(context)}


def refusal(folder: Path, **given: str) -> str:
    """What the launch says when it does not begin: the real one where it is installed, else the function that checks."""
    if importlib.util.find_spec('launch') and importlib.util.find_spec('launch_ros'):
        words = [f'{name}:={value}' for name, value in given.items()]
        started = [sys.executable, '-c', REAL, str(ROOT / 'launch' / 'advise.launch.py'), *words]
        run = subprocess.run(started, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
        return run.stdout + run.stderr
    with contextlib.chdir(folder):
        try:
            nodes(launch_file(), **given)
        except RuntimeError as problem:
            return str(problem)
    return ''


REAL = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
given = [tuple(word.split(':=', 1)) for word in sys.argv[2:]]
service = LaunchService()
included = IncludeLaunchDescription(PythonLaunchDescriptionSource(sys.argv[1]), launch_arguments=given)
service.include_launch_description(LaunchDescription([included]))
sys.exit(service.run())
"""
