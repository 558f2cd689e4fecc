"""The launch file's nodes for each backend and argument; `ros2 launch` itself is not among the wheels (support/launching.py)."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from support import launching
from support.launching import Context, nodes, refusal
from support.paths import ROOT

CONFIG = ROOT / 'config'
GIVEN = {'g.yaml': '', 'map.yaml': '', 'site.yaml': '', 'my.yaml': '/**: {ros__parameters: {grid_file: g.yaml}}'}


@pytest.fixture(name='launch_file')
def loaded_launch_file(folder: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.chdir(folder)
    return launching.launch_file()


@pytest.fixture(name='folder')
def with_files(tmp_path: Path) -> Path:
    for name, text in GIVEN.items():
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.mark.parametrize(
    ('backend', 'carriers'),
    [
        ('sim', {'simulator', 'mavlink_bridge', 'pilot', 'expert'}),
        ('ardupilot', {'mavlink_bridge'}),
        ('px4', {'mavlink_bridge'}),
        ('px4_dds', {'mavlink_bridge'}),
        ('mavros', {'guard'}),
        ('ardupilot_dds', {'guard'}),
    ],
)
def test_each_backend_has_its_nodes(launch_file: ModuleType, backend: str, carriers: set[str]) -> None:
    found = nodes(launch_file, backend=backend, namespace='drone1', log_level='debug')
    assert set(found) == {'recorder', 'advise', 'policy'} | carriers
    for name, node in found.items():
        assert (node.package, node.namespace, node.ros_arguments) == ('advise_ros', 'drone1', ['--log-level', 'debug'])
        assert node.parameters[0] == f'{CONFIG}/advise.yaml'
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
    assert page.parameters[1]['grid_file'] == f'{CONFIG}/grid_6x6.yaml'
    assert 'grid_file' not in nodes(launch_file, params_file='my.yaml', console='true')['console'].parameters[1]


def test_maps_go_to_every_node_that_plans_ways_and_the_site_to_the_learner(launch_file: ModuleType) -> None:
    found = nodes(launch_file, obstacle_map_file='map.yaml', site_map_file='site.yaml', site_map_out='site.yaml')
    given = {name for name, node in found.items() if node.parameters[1].get('obstacle_map_file') == 'map.yaml'}
    assert given == {'recorder', 'advise', 'policy', 'pilot', 'expert'}
    of_site = {name for name, node in found.items() if 'site_map_file' in node.parameters[1]}
    assert of_site == {'advise'} and found['advise'].parameters[1]['site_map_out'] == 'site.yaml'
    assert not any('obstacle_map_file' in node.parameters[1] for node in nodes(launch_file).values())


def test_rviz_shows_the_shipped_view_in_the_namespace_and_time_of_the_graph(launch_file: ModuleType) -> None:
    view = nodes(launch_file, rviz='true', namespace='drone1')['rviz2']
    assert view.arguments == ['-d', f'{CONFIG}/advise.rviz']
    assert (view.namespace, view.parameters) == ('drone1', [{'use_sim_time': True}])
    assert nodes(launch_file, rviz='true', backend='mavros')['rviz2'].parameters == [{'use_sim_time': False}]


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
    assert nodes(launch_file)['policy'].parameters[1]['grid_file'] == f'{CONFIG}/grid_6x6.yaml'
    own = nodes(launch_file, params_file='my.yaml')
    assert 'grid_file' not in own['policy'].parameters[1]
    assert 'url' not in own['mavlink_bridge'].parameters[1]
    assert nodes(launch_file, params_file='my.yaml', grid_file='g.yaml')['policy'].parameters[1]['grid_file'] == 'g.yaml'


@pytest.mark.parametrize(('given', 'sentence'), [
    ({'grid_file': 'nowhere.yaml'}, 'grid_file is nowhere.yaml, and there is no such file'),
    ({'params_file': 'nowhere.yaml'}, 'params_file is nowhere.yaml, and there is no such file'),
    ({'site_map_file': 'nowhere.yaml'}, 'site_map_file is nowhere.yaml, and there is no such file'),
    ({'bag': 'map.yaml'}, 'bag is map.yaml, which is there already'),
    ({'params_file': 'g.yaml'}, 'no grid: params_file g.yaml gives it no grid_file; name one for all by grid_file:=FILE'),
    ({'params_file': 'other.yaml'}, 'recorder has no grid: params_file other.yaml gives it no grid_file'),
    ({'params_file': 'gone.yaml'}, 'has grid_file gone.grid of gone.yaml, and there is no such file'),
    ({'params_file': 'tab.yaml'}, 'params_file tab.yaml cannot be read'),
])
def test_a_missing_file_stops_the_launch_with_a_sentence(folder: Path, given: dict[str, str], sentence: str) -> None:
    elsewhere = '/far/recorder: {ros__parameters: {grid_file: g.yaml}}'
    (folder / 'other.yaml').write_text(f'/**/mavlink_bridge: {{ros__parameters: {{fence: "off"}}}}\n{elsewhere}')
    (folder / 'gone.yaml').write_text('/**: {ros__parameters: {grid_file: gone.grid}}')
    (folder / 'tab.yaml').write_text('/**:\n\tros__parameters: {}')
    assert sentence in refusal(folder, **given)


def test_the_particular_of_a_parameter_file_comes_after_the_general(launch_file: ModuleType, folder: Path) -> None:
    entries = {'/**': 'none', '/*/advise': 'g.yaml', 'drone1/recorder': 'map.yaml'}
    lines = [f'{name}: {{ros__parameters: {{grid_file: {value}}}}}' for name, value in entries.items()]
    (folder / 'my.yaml').write_text('\n'.join(lines))
    given = {'params_file': 'my.yaml', 'namespace': 'drone1', 'pushed': ''}
    found = {name: dict(launch_file._parameters_of(name, given)) for name in ('policy', 'advise', 'recorder')}
    assert {name: values['grid_file'] for name, values in found.items()} == {
        'policy': 'none', 'advise': 'g.yaml', 'recorder': 'map.yaml',
    }


def test_a_needed_node_that_fails_ends_the_others(launch_file: ModuleType) -> None:
    found = nodes(launch_file, console='true', bag='bag1')
    assert {name for name, node in found.items() if node.on_exit is not None} == {
        'simulator', 'mavlink_bridge', 'recorder', 'advise', 'policy', 'logger',
    }
    died = SimpleNamespace(process_name='advise-4', returncode=2)
    said, ends = found['advise'].on_exit(died, Context())
    assert 'advise-4 ended with exit code 2' in said.msg
    assert 'advise-4' in ends.reason
    assert found['advise'].on_exit(SimpleNamespace(process_name='advise-4', returncode=0), Context()) is None
    assert found['advise'].on_exit(died, SimpleNamespace(is_shutdown=True)) is None
    assert not any(node.on_exit for node in nodes(launch_file, on_exit='go_on').values())


def test_nodes_are_started_again_as_often_as_it_helps(launch_file: ModuleType) -> None:
    found = nodes(launch_file, respawn='true')
    assert {name for name, node in found.items() if not node.respawn} == {'pilot', 'expert'}
    assert {node.on_exit for node in found.values()} == {None}
    assert {(node.respawn_delay, node.respawn_max_retries) for node in found.values()} == {(2.0, 5)}


def test_other_launch_files_include_the_graph_with_their_own_topics(launch_file: ModuleType) -> None:
    found = nodes(launch_file, backend='own', pose_topic='odometry/pose', command_topic='checked')
    assert dict(found['guard'].remappings) == {'pose': 'odometry/pose', 'guard/cmd_vel': 'checked'}
    assert set(found) == {'guard', 'recorder', 'advise', 'policy'}


@pytest.mark.parametrize('name', ['bringup', 'fly'])
def test_what_an_including_file_passes_on_is_an_argument_of_the_graph(launch_file: ModuleType, name: str) -> None:
    known = {argument.name for argument in launch_file.generate_launch_description().args[0][:-1]}
    file = launching.launch_file(name=name)
    passed = set(file.PASSED_ON if name == 'bringup' else file.DEFAULTS)
    assert passed <= known
    declared = [one.name for one in file.generate_launch_description().args[0] if isinstance(one.name, str)]
    assert set(declared) == passed
