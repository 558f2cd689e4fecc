"""What to do where Python packages are missing, as after `colcon build` in a workspace of ROS 2 alone.

This is read when an import has failed, so it takes the standard library only.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

# Module -> the package that has it, where their names differ; requirements/app.in says what each is for.
MODULES = {
    'sklearn': 'scikit-learn', 'serial': 'pyserial', 'mcap_ros2': 'mcap-ros2-support', 'yaml': 'pyyaml', 'ruamel': 'ruamel.yaml',
    'PIL': 'pillow',
} | {name: name for name in (
    'numpy', 'scipy', 'highspy', 'cvxpy', 'clarabel', 'piqp', 'qdldl', 'numba', 'joblib', 'dask', 'distributed', 'threadpoolctl',
    'pymavlink', 'mcap', 'rosbags', 'pyulog', 'pymap3d', 'fastkml', 'geojson', 'zstandard', 'lz4', 'rotorpy', 'cvxopt', 'rich',
    'jinja2', 'matplotlib', 'nicegui', 'babel',
)}  # fmt: skip
# What ROS itself brings: no package of ours puts it right.
OF_ROS = ('rclpy', 'advise_msgs')
# Messages of an autopilot, for those who fly it by its topics.
PX4 = (
    "px4_msgs is not there: install it for PX4's release (sudo apt install ros-jazzy-px4-msgs is of one release only; else clone "
    'https://github.com/PX4/px4_msgs -b release/1.17 into the workspace, build it and source it), or fly by MAVLink '
    '(url:=udpin:127.0.0.1:14540)'
)
LOCK = 'requirements/system-lock.txt'


def remedy(module: str) -> str | None:
    """What is missing beside a module that could not be imported, and the line that installs it; None if it is not ours to say.

    Args:
        module: name of the module, as ModuleNotFoundError has it.
    """
    top = module.partition('.')[0]
    if top in OF_ROS:
        return f'{top} is not there: source ROS 2 Jazzy and the workspace (. install/setup.bash), or run it by ./advise'
    if top not in MODULES:
        return None
    missing = {top} | {name for name in MODULES if find_spec(name) is None}
    names = ', '.join(sorted(MODULES[name] for name in missing))
    return (
        f'this Python ({sys.executable}) lacks {names}; install what advise_ros needs beside ROS into a virtual environment that '
        f"sees the system's packages: python3 -m venv --system-site-packages .venv && .venv/bin/pip install --require-hashes "
        f'-r {_lock()}, then build again by that Python (CONTRIBUTING.md, "In a workspace")'
    )


def _lock() -> Path | str:
    """The list of exact versions: of the source tree, or as it was installed beside the package."""
    package = Path(__file__).resolve().parent
    places = [package.parent / LOCK, *(parent / 'share' / 'advise_ros' / LOCK for parent in package.parents)]
    return next((place for place in places if place.exists()), LOCK)
