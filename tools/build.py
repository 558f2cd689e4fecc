"""colcon build of advise_msgs and advise_ros, and the environment that the executables run in."""

from __future__ import annotations

import json
import os
import shlex
import shutil
from pathlib import Path

from packages import headers, plain_env
from prerequisites import SetupError
from shell import Shell

KEPT = ('AMENT_PREFIX_PATH', 'PYTHONPATH', 'LD_LIBRARY_PATH', 'CMAKE_PREFIX_PATH', 'COLCON_PREFIX_PATH')
KEPT_ROS = ('ROS_DISTRO', 'ROS_VERSION', 'ROS_PYTHON_VERSION', 'PKG_CONFIG_PATH')


def packages(shell: Shell, venv: Path, system: bool) -> None:
    """Build both packages into install/ and write .venv/environment.sh.

    Raises:
        SetupError: the build failed.
    """
    marker = shell.root / 'build' / 'unfinished'
    if marker.exists():  # A build that was cut off may have left half a configuration.
        for folder in ('build', 'install'):
            shutil.rmtree(shell.root / folder)
    marker.parent.mkdir(exist_ok=True)
    marker.touch()
    shell.say('colcon build of advise_msgs and advise_ros (half a minute)')
    env = build_env(venv, system)
    command = [venv / 'bin' / 'python', find_colcon(venv, system), 'build', '--cmake-args', '-DBUILD_TESTING=OFF']
    if headers(venv):
        command.append(f'-DPython3_INCLUDE_DIR={headers(venv)}')
    shell.run('colcon build', command, env)
    _write_environment(shell, venv, env, system)
    shell.say('first import of everything')
    shell.try_run(['sh', '-c', f'. {shlex.quote(str(venv / "environment.sh"))} && exec python tools/warm.py'], env)
    marker.unlink()


def find_colcon(venv: Path, system: bool) -> str:
    """The colcon script; it is run by the environment's Python, which the executables then name.

    Raises:
        SetupError: the full installation has no colcon.
    """
    if not system:
        return str(venv / 'bin' / 'colcon')
    found = shutil.which('colcon')
    if found is None:
        raise SetupError("'colcon' is missing: sudo apt install python3-colcon-common-extensions")
    return found


def build_env(venv: Path, system: bool) -> dict[str, str]:
    """Environment of the build: the wheels alone, or the sourced ROS."""
    env = dict(os.environ) if system else plain_env()
    env['PATH'] = f'{venv / "bin"}{os.pathsep}{env["PATH"]}'
    env['VIRTUAL_ENV'] = str(venv)
    for name in ('COLCON_DEFAULTS_FILE', 'PYTHONDONTWRITEBYTECODE'):
        env.pop(name, None)
    if not system:
        env['AMENT_PREFIX_PATH'] = env['CMAKE_PREFIX_PATH'] = str(venv)
        if headers(venv):
            fetched = Path(headers(venv))
            env['CPATH'] = f'{fetched}{os.pathsep}{fetched.parent}'
    return env


def _write_environment(shell: Shell, venv: Path, env: dict[str, str], system: bool) -> None:
    """Keep what sourcing install/setup.bash yields, so that ./advise need not do it at every start."""
    names = [*KEPT, *(KEPT_ROS if system else ())]
    keep = f'import json, os; print(json.dumps({{name: os.environ[name] for name in {names} if name in os.environ}}))'
    ask = f'. install/setup.bash && exec python -c {shlex.quote(keep)}'
    sourced = json.loads(shell.run('reading the environment', ['bash', '-c', ask], env).splitlines()[-1])
    lines = [f'export {name}={shlex.quote(sourced[name])}' for name in names if name in sourced]
    lines.append(f'export VIRTUAL_ENV={shlex.quote(str(venv))}')
    lines.append(f'export PATH={shlex.quote(str(venv / "bin"))}:"$PATH"')
    if not system:  # The wheels restart every Python to set the library path, unless told that it is set.
        lines.append('export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1')
    text = '# Written by set-up, read by ./advise.\n' + '\n'.join(lines) + '\n'
    (venv / 'environment.sh').write_text(text)
