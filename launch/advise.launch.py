"""The graph around one vehicle: the simulator, ArduPilot or PX4 by MAVLink, MAVROS, or ArduPilot's DDS.

    ros2 launch advise_ros advise.launch.py backend:=sim
    ros2 launch advise_ros advise.launch.py backend:=sim actors:=false console:=true
    ros2 launch advise_ros advise.launch.py backend:=ardupilot url:=udpin:127.0.0.1:14550 grid_file:=/path/to/grid.yaml
    ros2 launch advise_ros advise.launch.py backend:=mavros namespace:=drone1 bag:=/tmp/session
    ros2 launch advise_ros advise.launch.py backend:=ardupilot_dds dds_prefix:=ap/v1

All names are relative: `namespace` moves the whole graph, and with it the topics of MAVROS or DDS that are used.
"""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

CONFIG = Path(get_package_share_directory('advise_ros')) / 'config'
DEFAULT_GRID, DEFAULT_PARAMETERS = str(CONFIG / 'grid_6x6.yaml'), str(CONFIG / 'advise.yaml')

# Who carries the commands to the vehicle.
CARRIERS = {
    'sim': ('simulator', 'mavlink_bridge'),
    'ardupilot': ('mavlink_bridge',),
    'px4': ('mavlink_bridge',),
    'mavros': ('guard',),
    'ardupilot_dds': ('guard',),
}
LEARNERS = ('recorder', 'advise', 'policy')
ACTORS = ('pilot', 'expert')
MANAGED = ('policy', 'guard', 'mavlink_bridge')
PLAN_WAYS = (*LEARNERS, *ACTORS)
HAVE_A_GRID = ('mavlink_bridge', 'guard', *PLAN_WAYS, 'console')

URLS = {'sim': 'udpin:127.0.0.1:14550', 'ardupilot': 'udpin:127.0.0.1:14550', 'px4': 'udpin:127.0.0.1:14540'}

# Backend without our bridge -> the topic of its position and that of its commands. Commands reach it through the guard only.
FOREIGN_TOPICS = {
    'mavros': ('mavros/local_position/pose', 'mavros/setpoint_velocity/cmd_vel'),
    'ardupilot_dds': ('{dds_prefix}/pose/filtered', '{dds_prefix}/cmd_vel'),
}
# ArduPilot's DDS calls the frame of its ENU pose base_link; what the guard passes on is in map.
POSE_FRAMES = {'ardupilot_dds': 'base_link'}

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
        'url', default_value='', description='MAVLink connection; empty: of the parameter file, or the usual one of the backend',
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


def node(name: str, given: dict[str, str]) -> Node:
    return Node(
        package='advise_ros', executable=name, namespace=given['namespace'], output='screen', emulate_tty=True,
        parameters=[given['params_file'], own_parameters(name, given)],
        remappings=remappings(name, given),
        ros_arguments=['--log-level', given['log_level']],
    )


def graph(context: LaunchContext) -> list[Node]:
    """All nodes for the given arguments."""
    given = {argument.name: LaunchConfiguration(argument.name).perform(context) for argument in ARGUMENTS}
    nodes = [node(name, given) for name in executables(given)]
    if given['rviz'] == 'true':
        nodes.append(Node(package='rviz2', executable='rviz2', arguments=['-d', str(CONFIG / 'advise.rviz')]))
    return nodes


def generate_launch_description() -> LaunchDescription:
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=graph)])
