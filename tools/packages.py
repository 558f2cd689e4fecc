"""The virtual environment and the packages in it, at the versions and with the hashes of the lock file."""

from __future__ import annotations

import os
import re
import shutil
import sys
import sysconfig
from pathlib import Path

import prerequisites
from prerequisites import SetupError
from shell import Shell

# What pip is configured with -> how the faster installer is told the same.
UV_NAMES = {
    'index-url': 'UV_DEFAULT_INDEX',
    'extra-index-url': 'UV_INDEX',
    'find-links': 'UV_FIND_LINKS',
    'cert': 'SSL_CERT_FILE',
    'trusted-host': 'UV_INSECURE_HOST',
    'proxy': 'ALL_PROXY',
}
# The wheels' exported CMake files name the Python of the machine that they were built on.
BUILDER_NUMPY = re.compile(r'/opt/python/cp3\d+-cp3\d+/lib/python3\.\d+/site-packages/numpy/_core/include')
BUILDER_PYTHON = re.compile(r'/opt/python/cp3\d+-cp3\d+/include/python3\.\d+')


def base_python() -> str:
    """The interpreter itself, also when it was started through a virtual environment."""
    return os.path.realpath(getattr(sys, '_base_executable', None) or sys.executable)


def lock(root: Path, system: bool) -> Path:
    """The lock file: of everything, or of what a full ROS installation lacks."""
    return root / 'requirements' / ('system-lock.txt' if system else 'lock.txt')


def install(shell: Shell, venv: Path, system: bool) -> None:
    """Make the virtual environment anew.

    Raises:
        SetupError: a command failed.
    """
    version = f'Python {sys.version_info.major}.{sys.version_info.minor}'
    shell.say(f'{venv.name}/ with {version}{", beside the sourced ROS 2 Jazzy" if system else ""}')
    shutil.rmtree(venv, ignore_errors=True)
    venv.mkdir(exist_ok=True)
    (venv / 'COLCON_IGNORE').touch()  # Else colcon takes the wheels' package.xml files for sources.
    flags = ['--system-site-packages'] if system else []
    shell.run('making the virtual environment', [base_python(), '-m', 'venv', *flags, venv])
    wanted = lock(shell.root, system)
    shell.say(f'{count(wanted)} packages from {wanted.relative_to(shell.root)}' + ('' if system else ' (ROS 2 Jazzy among them)'))
    if not _install_fast(shell, venv, wanted):
        shell.say('the fast installer could not do it; pip goes on (a minute)')
        pip = [venv / 'bin' / 'python', '-m', 'pip', 'install', '--quiet', '--no-compile']
        shell.run('installing packages', [*pip, '--require-hashes', '-r', wanted], plain_env())
    if system:
        _check_sourced_ros(shell, venv)
    else:
        _name_this_python(shell, venv)
        _find_headers(shell, venv)


def count(wanted: Path) -> int:
    """Different packages in a lock file."""
    return len({line.split('==')[0] for line in wanted.read_text().splitlines() if re.match(r'[a-z0-9]', line)})


def plain_env() -> dict[str, str]:
    """This environment without what an activated environment or workspace left in it."""
    gone = ('PYTHONPATH', 'PYTHONHOME', 'AMENT_PREFIX_PATH', 'CMAKE_PREFIX_PATH', 'COLCON_PREFIX_PATH', 'VIRTUAL_ENV')
    return {name: value for name, value in os.environ.items() if name not in gone and not name.startswith('_ROS_WHEELS')}


def _install_fast(shell: Shell, venv: Path, wanted: Path) -> bool:
    """Install by uv; False when pip had better try."""
    python, env = venv / 'bin' / 'python', plain_env()
    bootstrap = shell.root / 'requirements' / 'bootstrap-lock.txt'
    pip = [python, '-m', 'pip', 'install', '--quiet', '--retries', '2', '--no-compile', '--require-hashes']
    code, output = shell.try_run([*pip, '-r', bootstrap], env)
    if code:
        if prerequisites.unreachable(output):
            raise SetupError(f'installing packages failed: {prerequisites.reason(output)} (log: {shell.log})')
        return False
    settings = pip_settings(shell, python)
    if 'no-index' in settings:
        return False
    for name, value in settings.items():
        if name in UV_NAMES:
            env.setdefault(UV_NAMES[name], ' '.join(value.split()))
    uv = [venv / 'bin' / 'uv', 'pip', 'install', '--quiet', '--no-config', '--python', python, '--require-hashes']
    return shell.try_run([*uv, '-r', wanted], env)[0] == 0


def pip_settings(shell: Shell, python: Path) -> dict[str, str]:
    """Option -> value of the user's pip configuration, as `pip config list` shows it."""
    listed = shell.try_run([python, '-m', 'pip', 'config', 'list'], plain_env())[1]
    found = {}
    for line in listed.splitlines():
        key, equals, value = line.partition('=')
        if equals:
            found[key.rsplit('.', 1)[-1]] = value.strip().strip('\'"').replace('\\n', ' ')
    return found


def _check_sourced_ros(shell: Shell, venv: Path) -> None:
    code, _ = shell.try_run([venv / 'bin' / 'python', '-c', 'import rclpy'])
    if code:
        number = f'{sys.version_info.major}.{sys.version_info.minor}'
        raise SetupError(f'the sourced ROS 2 does not load in Python {number}; name its own: make PYTHON=/usr/bin/python3')


def _name_this_python(shell: Shell, venv: Path) -> None:
    """Let the wheels' CMake files name this environment's Python and numpy."""
    ask = 'import sysconfig, numpy; print(sysconfig.get_paths()["include"]); print(numpy.get_include())'
    python, numpy = shell.run('asking Python for its paths', [venv / 'bin' / 'python', '-c', ask], plain_env()).split()[-2:]
    for path in (venv / 'share').rglob('*.cmake'):
        text = path.read_text()
        ours = BUILDER_PYTHON.sub(headers(venv) or python, BUILDER_NUMPY.sub(numpy, text))
        if ours != text:
            path.unlink()  # The file may be shared with the installer's cache: never write into it.
            path.write_text(ours)


def headers(venv: Path) -> str:
    """Directory of Python.h that set-up fetched, or '' when Python has its own."""
    found = sorted(venv.glob('headers/usr/include/python3*/Python.h'))
    return str(found[0].parent) if found else ''


def _find_headers(shell: Shell, venv: Path) -> None:
    """Fetch the distribution's header files of Python where they are not installed; no root is needed for that.

    Raises:
        SetupError: they are missing and cannot be fetched.
    """
    if Path(sysconfig.get_paths()['include'], 'Python.h').exists():
        return
    shell.say('header files of Python, which are not installed here')
    place = venv / 'headers'
    place.mkdir()
    package = f'libpython{sys.version_info.major}.{sys.version_info.minor}-dev'
    code, _ = shell.try_run(['sh', '-c', f'cd "{place}" && apt-get download {package} && dpkg-deb -x {package}_*.deb .'])
    if code or not headers(venv):
        raise SetupError(prerequisites.python_headers())
