"""The launch file's nodes for each backend and argument; `ros2 launch` itself is not among the wheels (support/launching.py)."""

from __future__ import annotations

from types import ModuleType

import pytest

from support import launching
from support.launching import nodes


@pytest.fixture(name='launch_file')
def loaded_launch_file() -> ModuleType:
    return launching.launch_file()


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


def test_maps_go_to_every_node_that_plans_ways_and_the_site_to_the_learner(launch_file: ModuleType) -> None:
    found = nodes(launch_file, obstacle_map_file='map.yaml', site_map_file='site.yaml', site_map_out='site.yaml')
    given = {name for name, node in found.items() if node.parameters[1].get('obstacle_map_file') == 'map.yaml'}
    assert given == {'recorder', 'advise', 'policy', 'pilot', 'expert'}
    of_site = {name for name, node in found.items() if 'site_map_file' in node.parameters[1]}
    assert of_site == {'advise'} and found['advise'].parameters[1]['site_map_out'] == 'site.yaml'
    assert not any('obstacle_map_file' in node.parameters[1] for node in nodes(launch_file).values())


def test_rviz_shows_the_shipped_view(launch_file: ModuleType) -> None:
    assert nodes(launch_file, rviz='true')['rviz2'].arguments == ['-d', '/share/advise_ros/config/advise.rviz']


@pytest.mark.parametrize(('backend', 'pose', 'command', 'frame'), [
    ('mavros', 'mavros/local_position/pose', 'mavros/setpoint_velocity/cmd_vel', None),
    ('ardupilot_dds', 'ap/pose/filtered', 'ap/cmd_vel', 'base_link'),
    ('ardupilot_dds dds_prefix:=ap/v1', 'ap/v1/pose/filtered', 'ap/v1/cmd_vel', 'base_link'),
])
def test_others_get_commands_from_the_guard_alone(
    launch_file: ModuleType, backend: str, pose: str, command: str, frame: str | None,
) -> None:
    found = nodes(launch_file, **dict(argument.split(':=') for argument in f'backend:={backend}'.split()))
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
