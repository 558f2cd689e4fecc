"""The launch file, without the `launch` packages: they are not on PyPI.

MOCK: small stand-ins for `launch` and `launch_ros` record what the file asks for. That a real
`ros2 launch` takes it is tried on a full ROS installation.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]


class Recorded(SimpleNamespace):
    """Stand-in for a launch class: keeps its arguments."""

    def __init__(self, *args: Any, **named: Any) -> None:
        super().__init__(args=args, name=args[0] if args else None, **named)


class Configuration(Recorded):
    def perform(self, context: dict[str, str]) -> str:
        return context[self.name]


@pytest.fixture
def launch_file(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The module launch/advise.launch.py over the stand-ins."""
    contents = {
        'launch': {'LaunchContext': dict, 'LaunchDescription': Recorded},
        'launch.actions': {'DeclareLaunchArgument': Recorded, 'OpaqueFunction': Recorded},
        'launch.substitutions': {'LaunchConfiguration': Configuration},
        'launch_ros': {},
        'launch_ros.actions': {'Node': Recorded},
        'launch_ros.parameter_descriptions': {'ParameterValue': lambda value, value_type: value_type(value)},
        'ament_index_python.packages': {'get_package_share_directory': lambda name: f'/share/{name}'},
    }
    for name, members in contents.items():
        module = ModuleType(name)
        vars(module).update(members)
        monkeypatch.setitem(sys.modules, name, module)
    spec = importlib.util.spec_from_file_location('advise_launch', ROOT / 'launch' / 'advise.launch.py')
    assert spec is not None
    assert spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def nodes(launch_file: ModuleType, **given: str) -> dict[str, Recorded]:
    """Executable -> node for launch arguments as a user types them."""
    *arguments, opaque = launch_file.generate_launch_description().args[0]
    values = {argument.name: argument.default_value for argument in arguments}
    assert set(given) <= set(values)
    return {node.executable: node for node in opaque.function({**values, **given})}


@pytest.mark.parametrize(
    ('backend', 'carriers'),
    [
        ('sim', {'simulator', 'mavlink_bridge', 'pilot', 'expert'}),
        ('ardupilot', {'mavlink_bridge'}),
        ('px4', {'mavlink_bridge'}),
        ('mavros', {'guard'}),
        ('ardupilot_dds', {'guard'}),
    ],
)
def test_each_backend_has_its_nodes(launch_file: ModuleType, backend: str, carriers: set[str]) -> None:
    found = nodes(launch_file, backend=backend, namespace='drone1', log_level='debug')
    assert set(found) == {'recorder', 'advise', 'policy'} | carriers
    for name, node in found.items():
        assert (node.package, node.namespace, node.ros_arguments) == ('advise_ros', 'drone1', ['--log-level', 'debug'])
        assert node.parameters[0] == '/share/advise_ros/config/advise.yaml'
        assert node.parameters[1].get('use_sim_time', False) == (backend == 'sim' and name != 'simulator')


def test_a_person_in_place_of_the_simulated_ones(launch_file: ModuleType) -> None:
    assert {'pilot', 'expert'}.isdisjoint(nodes(launch_file, backend='sim', actors='false'))


@pytest.mark.parametrize('backend', ['sim', 'mavros'])
def test_managed_nodes_wait_when_asked_to(launch_file: ModuleType, backend: str) -> None:
    waiting = nodes(launch_file, backend=backend, autostart='false')
    told = {name: node.parameters[1]['autostart'] for name, node in waiting.items() if 'autostart' in node.parameters[1]}
    assert told == {'policy': False, 'mavlink_bridge' if backend == 'sim' else 'guard': False}
    assert not any('autostart' in node.parameters[1] for node in nodes(launch_file, backend=backend).values())


def test_a_bag_brings_the_logger(launch_file: ModuleType) -> None:
    assert 'logger' not in nodes(launch_file)
    assert nodes(launch_file, bag='/tmp/bag')['logger'].parameters[1]['bag'] == '/tmp/bag'


def test_the_page_is_a_switch(launch_file: ModuleType) -> None:
    assert 'console' not in nodes(launch_file)
    page = nodes(launch_file, backend='mavros', console='true', namespace='drone1')['console']
    assert (page.output, page.namespace, dict(page.remappings)) == ('screen', 'drone1', {'pose': 'guard/pose'})
    assert page.parameters[1]['grid_file'] == '/share/advise_ros/config/grid_6x6.yaml'
    assert 'grid_file' not in nodes(launch_file, params_file='my.yaml', console='true')['console'].parameters[1]


def test_rviz_shows_the_shipped_view(launch_file: ModuleType) -> None:
    assert nodes(launch_file, rviz='true')['rviz2'].arguments == ['-d', '/share/advise_ros/config/advise.rviz']


@pytest.mark.parametrize(('backend', 'pose', 'command', 'frame'), [
    ('mavros', 'mavros/local_position/pose', 'mavros/setpoint_velocity/cmd_vel', None),
    ('ardupilot_dds', 'ap/pose/filtered', 'ap/cmd_vel', 'base_link'),
])
def test_others_get_commands_from_the_guard_alone(
    launch_file: ModuleType, backend: str, pose: str, command: str, frame: str | None,
) -> None:
    found = nodes(launch_file, backend=backend)
    targets = {name: dict(node.remappings) for name, node in found.items()}
    assert [name for name, remaps in targets.items() if command in remaps.values()] == ['guard']
    assert targets['guard']['pose'] == pose
    assert found['guard'].parameters[1].get('pose_frame') == frame
    for name in ('recorder', 'policy'):
        assert targets[name]['pose'] == 'guard/pose'
    assert all(not new.startswith('/') for remaps in targets.values() for new in remaps.values())


def test_both_ends_of_the_simulated_link_meet(launch_file: ModuleType) -> None:
    found = nodes(launch_file, backend='sim', url='udpin:127.0.0.1:15999')
    assert found['mavlink_bridge'].parameters[1]['url'] == 'udpin:127.0.0.1:15999'
    assert found['simulator'].parameters[1]['endpoint'] == 'udpout:127.0.0.1:15999'


def test_a_parameter_file_of_ones_own_has_the_say(launch_file: ModuleType) -> None:
    assert nodes(launch_file)['policy'].parameters[1]['grid_file'] == '/share/advise_ros/config/grid_6x6.yaml'
    own = nodes(launch_file, params_file='my.yaml')
    assert 'grid_file' not in own['policy'].parameters[1]
    assert 'url' not in own['mavlink_bridge'].parameters[1]
    assert nodes(launch_file, params_file='my.yaml', grid_file='g.yaml')['policy'].parameters[1]['grid_file'] == 'g.yaml'
