"""colcon build of advise_msgs and advise_ros, and the environment that the executables run in."""

from __future__ import annotations

import json
import os
import shlex
import shutil
from collections.abc import Mapping
from pathlib import Path

from packages import base_python
from places import Place
from prerequisites import SetupError
from shell import Shell

KEPT = ('AMENT_PREFIX_PATH', 'PYTHONPATH', 'LD_LIBRARY_PATH', 'CMAKE_PREFIX_PATH', 'COLCON_PREFIX_PATH')
KEPT_ROS = ('ROS_DISTRO', 'ROS_VERSION', 'ROS_PYTHON_VERSION', 'PKG_CONFIG_PATH')
# What the user's shell may hold and would lead the environment's own Python astray, or let it compile everything at each start.
UNSET = ('PYTHONHOME', 'PYTHONSTARTUP', 'PYTHONUSERBASE', 'PYTHONPLATLIBDIR', 'PYTHONDONTWRITEBYTECODE')
LONGEST_SHEBANG = 120


def packages(shell: Shell, place: Place, system: bool) -> None:
    """Build both packages and write the place's environment.sh.

    Raises:
        SetupError: the build failed.
    """
    marker = place.build / 'unfinished'
    if marker.exists():  # A build that was cut off may have left half a configuration.
        for folder in (place.build, place.install):
            shutil.rmtree(folder, ignore_errors=True)
    place.build.mkdir(exist_ok=True)
    marker.touch()
    shell.say('colcon build of advise_msgs and advise_ros (half a minute)')
    env = build_env(place, system, shell.env)
    command = [place.venv / 'bin' / 'python', find_colcon(place, system), 'build']
    command += ['--build-base', place.build, '--install-base', place.install]
    command += ['--cmake-args', '-DBUILD_TESTING=OFF']
    if place.headers():
        command.append(f'-DPython3_INCLUDE_DIR={place.headers()}')
    shell.run('colcon build', command, env)
    for script in (place.install / 'advise_ros' / 'lib' / 'advise_ros').iterdir():
        start_by_shell(script)
    _write_environment(shell, place, env, system)
    shell.say('first import of everything')
    start = f'. {shlex.quote(str(place.venv / "environment.sh"))} && exec python tools/warm.py'
    shell.try_run(['sh', '-c', start], env)
    marker.unlink()


def find_colcon(place: Place, system: bool) -> str:
    """The colcon script; it is run by the environment's Python, which the executables then name."""
    return str(shutil.which('colcon') if system else place.venv / 'bin' / 'colcon')


def build_env(place: Place, system: bool, plain: Mapping[str, str]) -> dict[str, str]:
    """Environment of the build: the wheels alone, or the sourced ROS."""
    env = dict(os.environ) if system else dict(plain)
    env['PATH'] = f'{place.venv / "bin"}{os.pathsep}{env["PATH"]}'
    env['VIRTUAL_ENV'] = str(place.venv)
    for name in ('COLCON_DEFAULTS_FILE', 'PYTHONDONTWRITEBYTECODE'):
        env.pop(name, None)
    if not system:
        env['AMENT_PREFIX_PATH'] = env['CMAKE_PREFIX_PATH'] = str(place.venv)
        if place.headers():
            fetched = Path(place.headers())
            env['CPATH'] = f'{fetched}{os.pathsep}{fetched.parent}'
    return env


def start_by_shell(script: Path) -> None:
    """Let /bin/sh start a script whose `#!` line the kernel cannot read: its Python's path holds a space or is long."""
    text = script.read_text(encoding='utf-8')
    first, _, rest = text.partition('\n')
    python = first.removeprefix('#!').strip().strip('"')
    if first.startswith('#!/') and ' ' not in python and len(first) <= LONGEST_SHEBANG:
        return
    # To Python the lines between #! and the rest are one text that nobody reads; to sh they start Python.
    script.write_text(f"#!/bin/sh\n'''exec' \"{python}\" \"$0\" \"$@\"\n' '''\n{rest}", encoding='utf-8')


def _write_environment(shell: Shell, place: Place, env: dict[str, str], system: bool) -> None:
    """Keep what sourcing install/setup.bash yields, so that ./advise need not do it at every start."""
    names = [*KEPT, *(KEPT_ROS if system else ())]
    keep = f'import json, os; print(json.dumps({{name: os.environ[name] for name in {names} if name in os.environ}}))'
    ask = f'. {shlex.quote(str(place.install / "setup.bash"))} && exec python -c {shlex.quote(keep)}'
    # Left to itself, colcon's script starts this environment's Python by a path that a space would cut in two.
    sourcing = {**env, 'COLCON_PYTHON_EXECUTABLE': base_python()}
    sourced = json.loads(shell.run('reading the environment', ['bash', '-c', ask], sourcing).splitlines()[-1])
    if str(place.install / 'advise_ros') not in sourced.get('AMENT_PREFIX_PATH', '').split(os.pathsep):
        raise SetupError(f'sourcing {place.install / "setup.bash"} does not lead to what was built (log: {shell.log})')
    lines = [f'advise_root={shlex.quote(str(shell.root))}', f'unset {" ".join(UNSET)}']
    lines += [f'export {name}={shlex.quote(sourced[name])}' for name in names if name in sourced]
    lines.append(f'export VIRTUAL_ENV={shlex.quote(str(place.venv))}')
    lines.append(f'export PATH={shlex.quote(str(place.venv / "bin"))}:"$PATH"')
    lines.append('export PYTHONUTF8=1')  # Files and messages are UTF-8, whatever the locale says.
    if not system:  # The wheels restart every Python to set the library path, unless told that it is set.
        lines.append('export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1')
    text = '# Written by set-up, read by ./advise.\n' + '\n'.join(lines) + '\n'
    (place.venv / 'environment.sh').write_text(text, encoding='utf-8')
