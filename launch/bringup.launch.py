"""The nodes that learn, ask and fly, for other people's launch files: their vehicle, their bridge, their clock.

    IncludeLaunchDescription(
        PythonLaunchDescriptionSource([FindPackageShare('advise_ros'), '/launch/bringup.launch.py']),
        launch_arguments={
            'namespace': 'drone1', 'grid_file': grid_file, 'pose_topic': 'odometry/pose', 'command_topic': 'cmd_vel_checked',
        }.items(),
    )

recorder, advise, policy and guard; advise.launch.py has the arguments, and more of them. Included in a group that pushes a
namespace, it lies in that one.
"""

from __future__ import annotations

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, ThisLaunchFileDir

# Argument -> what it is without being named; '' has advise.launch.py decide.
PASSED_ON = {
    'namespace': '', 'grid_file': '', 'obstacle_map_file': '', 'site_map_file': '', 'site_map_out': '', 'pose_topic': 'pose',
    'command_topic': 'guard/cmd_vel', 'use_sim_time': 'false', 'autostart': '', 'respawn': 'false', 'on_exit': 'shutdown',
    'bag': '', 'console': 'false', 'log_level': 'info',
}


def generate_launch_description() -> LaunchDescription:
    given = {name: LaunchConfiguration(name) for name in PASSED_ON}
    include = IncludeLaunchDescription(
        PythonLaunchDescriptionSource([ThisLaunchFileDir(), '/advise.launch.py']),
        launch_arguments={**given, 'backend': 'own'}.items(),
    )
    same = 'as in advise.launch.py'
    declared = [DeclareLaunchArgument(name, default_value=value, description=same) for name, value in PASSED_ON.items()]
    # What the including file calls by the same names is not changed by ours.
    return LaunchDescription([*declared, GroupAction([include], scoped=True)])
