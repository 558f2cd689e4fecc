"""The graph around one vehicle: the simulator, ArduPilot or PX4 by MAVLink or by their DDS topics, or MAVROS.

    ros2 launch advise_ros advise.launch.py backend:=sim
    ros2 launch advise_ros advise.launch.py backend:=sim actors:=false console:=true
    ros2 launch advise_ros advise.launch.py backend:=ardupilot url:=udpin:127.0.0.1:14550 grid_file:=/path/to/grid.yaml
    ros2 launch advise_ros advise.launch.py backend:=mavros namespace:=drone1 bag:=/tmp/session
    ros2 launch advise_ros advise.launch.py backend:=px4_dds url:=px4_dds:/px4_1
    ros2 launch advise_ros advise.launch.py backend:=ardupilot_dds dds_prefix:=ap/v1
    ros2 launch advise_ros advise.launch.py backend:=own pose_topic:=odometry/pose command_topic:=cmd_vel_checked

All names are relative: `namespace` moves the whole graph, and with it the topics of MAVROS or DDS that are used. A file that is
missing stops the launch before anything starts. A node of the flight that fails ends all of it, or is started again
(respawn:=true). Other launch files include bringup.launch.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from advise_ros.ros import params_files

CONFIG = Path(get_package_share_directory('advise_ros')) / 'config'
DEFAULT_GRID, DEFAULT_PARAMETERS = str(CONFIG / 'grid_6x6.yaml'), str(CONFIG / 'advise.yaml')

# Who carries the commands to the vehicle.
CARRIERS = {
    'sim': ('simulator', 'mavlink_bridge'),
    'ardupilot': ('mavlink_bridge',),
    'px4': ('mavlink_bridge',),
    'px4_dds': ('mavlink_bridge',),
    'mavros': ('guard',),
    'ardupilot_dds': ('guard',),
    'own': ('guard',),
}
LEARNERS = ('recorder', 'advise', 'policy')
ACTORS = ('pilot', 'expert')
MANAGED = ('policy', 'guard', 'mavlink_bridge')
PLAN_WAYS = (*LEARNERS, *ACTORS)
HAVE_A_GRID = ('mavlink_bridge', 'guard', *PLAN_WAYS, 'console')

URLS = {
    'sim': 'udpin:127.0.0.1:14550', 'ardupilot': 'udpin:127.0.0.1:14550', 'px4': 'udpin:127.0.0.1:14540',
    'px4_dds': 'px4_dds:',
}

# Backend without our bridge -> the topic of its position and that of its commands. Commands reach it through the guard only.
FOREIGN_TOPICS = {
    'mavros': ('mavros/local_position/pose', 'mavros/setpoint_velocity/cmd_vel'),
    'ardupilot_dds': ('{dds_prefix}/pose/filtered', '{dds_prefix}/cmd_vel'),
    'own': ('{pose_topic}', '{command_topic}'),
}
# ArduPilot's DDS calls the frame of its ENU pose base_link; what the guard passes on is in map.
POSE_FRAMES = {'ardupilot_dds': 'base_link'}

# Without these nodes nothing is learnt, or nothing flies safely.
NEEDED = ('simulator', 'mavlink_bridge', 'guard', *LEARNERS, 'logger')
# As Nav2's bring-up waits. A node that does not come up in so many attempts has wrong parameters: its last lines say which.
RESPAWN_DELAY_S, RESPAWN_MOST = 2.0, 5

ARGUMENTS = (
    DeclareLaunchArgument('backend', default_value='sim', choices=list(CARRIERS), description='what is flown'),
    DeclareLaunchArgument('namespace', default_value='', description='namespace of all nodes'),
    DeclareLaunchArgument('params_file', default_value=DEFAULT_PARAMETERS, description='parameters of the nodes'),
    DeclareLaunchArgument(
        'grid_file', default_value='', description='grid and waypoints; empty: of the parameter file, or grid_6x6.yaml',
    ),
    DeclareLaunchArgument(
        'obstacle_map_file', default_value='', description='map of nav2_map_server with obstacles; empty: none',
    ),
    DeclareLaunchArgument(
        'site_map_file', default_value='', description='what is known of the site, from site_map_out or a map; empty: nothing',
    ),
    DeclareLaunchArgument('site_map_out', default_value='', description='keeps what is learnt of the site; empty: none'),
    DeclareLaunchArgument(
        'url', default_value='',
        description='connection of mavlink_bridge; empty: of the parameter file, or the usual one of the backend',
    ),
    DeclareLaunchArgument(
        'use_sim_time', default_value='', choices=['', 'true', 'false'], description='empty: true with backend sim only',
    ),
    DeclareLaunchArgument(
        'autostart', default_value='', choices=['', 'true', 'false'],
        description='policy, guard and mavlink_bridge become active at once; false: they wait for ros2 lifecycle set; '
        'empty: of the parameter file',
    ),
    DeclareLaunchArgument(
        'actors', default_value='true', choices=['true', 'false'],
        description='backend sim: start the simulated pilot and expert too; false: a person flies (teleop) and answers',
    ),
    DeclareLaunchArgument(
        'dds_prefix', default_value='ap', description='backend ardupilot_dds: what its topics begin with (newer ones: ap/v1)',
    ),
    DeclareLaunchArgument('pose_topic', default_value='pose', description='backend own: positions (PoseStamped, ENU)'),
    DeclareLaunchArgument(
        'command_topic', default_value='guard/cmd_vel', description='backend own: where checked commands go (TwistStamped, ENU)',
    ),
    DeclareLaunchArgument(
        'respawn', default_value='false', choices=['true', 'false'],
        description=f'start a node that fails again, after {RESPAWN_DELAY_S:g} s and {RESPAWN_MOST} times at most',
    ),
    DeclareLaunchArgument(
        'on_exit', default_value='shutdown', choices=['shutdown', 'go_on'],
        description='what the failure of a node of the flight does to the others, without respawn',
    ),
    DeclareLaunchArgument('bag', default_value='', description='directory of a bag to write; empty: none'),
    DeclareLaunchArgument(
        'console', default_value='false', choices=['true', 'false'], description="serve the person's page, and print its address",
    ),
    DeclareLaunchArgument('rviz', default_value='false', choices=['true', 'false'], description='show the map in RViz'),
    DeclareLaunchArgument('log_level', default_value='info', description='debug, info, warn, error or fatal'),
)


def executables(given: dict[str, str]) -> tuple[str, ...]:
    """Executables of this package that run."""
    actors = ACTORS if given['backend'] == 'sim' and given['actors'] == 'true' else ()
    wanted = (('logger', given['bag'] != ''), ('console', given['console'] == 'true'))
    return (*CARRIERS[given['backend']], *LEARNERS, *actors, *(name for name, runs in wanted if runs))


def own_parameters(name: str, given: dict[str, str]) -> dict[str, object]:
    """Parameters that follow from the launch arguments; they override those of the parameter file."""
    parameters: dict[str, object] = {}
    for parameter, value in texts(name, given).items():
        if value:
            parameters[parameter] = ParameterValue(value, value_type=str)
    if name in MANAGED and given['autostart']:
        parameters['autostart'] = given['autostart'] == 'true'
    if name != 'simulator':  # The simulator makes the clock; it cannot follow it.
        sim_time = given['use_sim_time'] or str(given['backend'] == 'sim').lower()
        parameters['use_sim_time'] = sim_time == 'true'
    return parameters


def texts(name: str, given: dict[str, str]) -> dict[str, str]:
    """Parameter -> value, '' where a parameter file of the user's own has the say."""
    usual = given['params_file'] == DEFAULT_PARAMETERS
    url = given['url'] or (URLS.get(given['backend'], '') if usual else '')
    grid_file = given['grid_file'] or (DEFAULT_GRID if usual else '')
    found = {'grid_file': grid_file} if name in HAVE_A_GRID else {}
    if name in PLAN_WAYS:
        found['obstacle_map_file'] = given['obstacle_map_file']
    if name == 'advise':
        found |= {key: given[key] for key in ('site_map_file', 'site_map_out')}
    if name == 'mavlink_bridge':
        found['url'] = url
    if name == 'simulator':
        found['endpoint'] = url.replace('udpin:', 'udpout:')
    if name == 'logger':
        found['bag'] = given['bag']
    if name == 'guard':
        found['pose_frame'] = POSE_FRAMES.get(given['backend'], '')
    return found


def remappings(name: str, given: dict[str, str]) -> list[tuple[str, str]]:
    """Topics of MAVROS or DDS in place of ours: the guard's own, and its pose for everybody else."""
    if given['backend'] not in FOREIGN_TOPICS or name in {'advise', 'expert'}:
        return []
    pose, command = (topic.format(**given) for topic in FOREIGN_TOPICS[given['backend']])
    return [('pose', pose), ('guard/cmd_vel', command)] if name == 'guard' else [('pose', 'guard/pose')]


def on_exit(event: Any, context: LaunchContext) -> list[Any] | None:
    """A needed node that failed ends all: the others would fly on without a fence, or learn nothing."""
    if event.returncode == 0 or context.is_shutdown:
        return None
    reason = f'{event.process_name} ended with exit code {event.returncode}; its last lines say why'
    return [LogInfo(msg=f'{reason}. Everything ends; respawn:=true or on_exit:=go_on goes on.'), Shutdown(reason=reason)]


def node(name: str, given: dict[str, str]) -> Node:
    respawns = given['respawn'] == 'true'
    ends_all = name in NEEDED and given['on_exit'] == 'shutdown' and not respawns
    return Node(
        package='advise_ros', executable=name, namespace=given['namespace'], output='screen', emulate_tty=True,
        parameters=[given['params_file'], own_parameters(name, given)],
        remappings=remappings(name, given),
        ros_arguments=['--log-level', given['log_level']],
        respawn=respawns and name not in ACTORS, respawn_delay=RESPAWN_DELAY_S, respawn_max_retries=RESPAWN_MOST,
        on_exit=on_exit if ends_all else None,
    )


def rviz(given: dict[str, str]) -> Node:
    """The map in the graph's namespace and by its clock; the topics of the view are relative."""
    sim_time = own_parameters('rviz2', given)['use_sim_time']
    return Node(
        package='rviz2', executable='rviz2', namespace=given['namespace'], arguments=['-d', str(CONFIG / 'advise.rviz')],
        parameters=[{'use_sim_time': sim_time}],
    )


# -- what is wrong before anything starts ----------------------------------------------------
FILES = ('params_file', 'grid_file', 'obstacle_map_file', 'site_map_file')


def check(given: dict[str, str]) -> None:
    """Look for the files that the nodes will read.

    Raises:
        RuntimeError: one is missing; the launch says its sentence and ends.
    """
    for argument in FILES:
        kept = argument == 'site_map_file' and given['site_map_file'] == given['site_map_out']
        if given[argument] and not kept and not Path(given[argument]).is_file():
            raise RuntimeError(f'{argument} is {given[argument]}, and there is no such file; name one that is there')
    if given['bag'] and Path(given['bag']).exists():
        raise RuntimeError(f'bag is {given["bag"]}, which is there already; name a new directory, recordings are not mixed')
    if not given['grid_file'] and given['params_file'] != DEFAULT_PARAMETERS:
        _check_grids(given)


def _check_grids(given: dict[str, str]) -> None:
    """With a parameter file of the user's own, it names the grid of every node that cannot do without."""
    needs_one = [name for name in executables(given) if name in (*LEARNERS, *ACTORS, 'mavlink_bridge', 'guard')]
    for name in needs_one:
        found = dict(_parameters_of(name, given))
        grid_file = str(found.get('grid_file', ''))
        fenced = name not in CARRIERS[given['backend']] or (found.get('fence') != 'off' and not found.get('fence_polygon'))
        if not grid_file and fenced:
            raise RuntimeError(
                f'{name} has no grid: params_file {given["params_file"]} gives it no grid_file; '
                'name one for all by grid_file:=FILE, or in the file below /**: ros__parameters:'
            )
        if grid_file and not Path(grid_file).is_file():
            raise RuntimeError(f'{name} has grid_file {grid_file} of {given["params_file"]}, and there is no such file')


def _parameters_of(name: str, given: dict[str, str]) -> Iterator[tuple[str, Any]]:
    """What a parameter file says of a node, the general before the particular as rcl reads it."""
    full_name = '/'.join(part.strip('/') for part in (given['pushed'], given['namespace'], name) if part.strip('/'))
    try:
        tree = yaml.safe_load(Path(given['params_file']).read_text(encoding='utf-8'))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as problem:
        first = ' '.join(str(problem).split())
        raise RuntimeError(f'params_file {given["params_file"]} cannot be read: {first}') from None
    for entry in params_files.entries(tree):
        if params_files.fits(full_name, entry.key):
            yield from entry.values.items()


def graph(context: LaunchContext) -> list[Node]:
    """All nodes for the given arguments."""
    given = {argument.name: LaunchConfiguration(argument.name).perform(context) for argument in ARGUMENTS}
    given['pushed'] = context.launch_configurations.get('ros_namespace', '')  # By a file that includes this one.
    check(given)
    nodes = [node(name, given) for name in executables(given)]
    return [*nodes, rviz(given)] if given['rviz'] == 'true' else nodes


def generate_launch_description() -> LaunchDescription:
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=graph)])
