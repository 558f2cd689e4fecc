"""A whole session: simulator or vehicle, bridge, recorder, learner, policy, logger and the page; what `./advise fly` starts.

    ros2 launch advise_ros fly.launch.py
    ros2 launch advise_ros fly.launch.py backend:=px4 grid_file:=/path/to/grid.yaml bag:=session1

Open the address that it prints. Ctrl-C ends all of it, and closes the bag. Every argument of advise.launch.py goes here, too.
"""

from __future__ import annotations

import time
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PythonExpression, ThisLaunchFileDir

GRID = str(Path(get_package_share_directory('advise_ros')) / 'config' / 'grid_demo.yaml')
# A parameter file of the user's own has the say.
USUAL_GRID = PythonExpression([repr(GRID), " if '", LaunchConfiguration('params_file', default=''), "' == '' else ''"])
DEFAULTS = {
    'grid_file': (USUAL_GRID, 'grid and waypoints; empty: of the parameter file'),
    'bag': (time.strftime('fly-%Y%m%d-%H%M%S'), 'directory of the bag to write'),
    'console': ('true', "serve the person's page, and print its address"),
    'actors': ('false', 'backend sim: start the simulated pilot and expert, too'),
}


def generate_launch_description() -> LaunchDescription:
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in DEFAULTS.items()),
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource([ThisLaunchFileDir(), '/advise.launch.py']),
            launch_arguments={name: LaunchConfiguration(name) for name in DEFAULTS}.items(),
        ),
    ])
