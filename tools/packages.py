"""The virtual environment and the packages in it, at the versions and with the hashes of the lock file."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path

import prerequisites
from places import Place
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
    """The lock file: of everything, or of what a full ROS installation lacks; tools of tests are in both."""
    return root / 'requirements' / ('system-dev-lock.txt' if system else 'lock.txt')


def install(shell: Shell, place: Place, system: bool) -> None:
    """Make the virtual environment of a new place.

    Raises:
        SetupError: a command failed.
    """
    version = f'Python {sys.version_info.major}.{sys.version_info.minor}'
    shell.say(f'.venv/ with {version}{", beside the sourced ROS 2 Jazzy" if system else ""}')
    if not system:
        _find_headers(shell, place)
    flags = ['--system-site-packages'] if system else []
    shell.run('making the virtual environment', [base_python(), '-m', 'venv', *flags, place.venv])
    wanted = lock(shell.root, system)
    shell.say(f'{count(wanted)} packages from {wanted.relative_to(shell.root)}' + ('' if system else ' (ROS 2 Jazzy among them)'))
    if not _install_fast(shell, place, wanted):
        shell.say('the fast installer could not do it; pip goes on (a minute)')
        pip = [place.venv / 'bin' / 'python', '-m', 'pip', 'install', '--quiet', '--no-compile']
        shell.run('installing packages', [*pip, '--require-hashes', '-r', wanted])
    if not system:
        _name_this_python(shell, place)


def count(wanted: Path) -> int:
    """Different packages in a lock file."""
    return len({line.split('==')[0] for line in wanted.read_text().splitlines() if re.match(r'[a-z0-9]', line)})


def _install_fast(shell: Shell, place: Place, wanted: Path) -> bool:
    """Install by uv; False when pip had better try."""
    python, env = place.venv / 'bin' / 'python', dict(shell.env)
    bootstrap = shell.root / 'requirements' / 'bootstrap-lock.txt'
    pip = [python, '-m', 'pip', 'install', '--quiet', '--retries', '2', '--no-compile', '--require-hashes']
    code, output = shell.try_run([*pip, '-r', bootstrap])
    if code:
        if prerequisites.unreachable(output):
            raise SetupError(f'installing packages failed: {prerequisites.reason(output)} (log: {shell.log})')
        return False
    settings = pip_settings(shell, python)
    if 'no-index' in settings:
        return False
    env.update(uv_settings(settings, env))
    if not _may_write(uv_cache(env)):
        env['UV_CACHE_DIR'] = str(place.scratch / 'uv')
    uv = [place.venv / 'bin' / 'uv', 'pip', 'install', '--quiet', '--no-config', '--python', python, '--require-hashes']
    return shell.try_run([*uv, '-r', wanted], env)[0] == 0


def uv_settings(settings: Mapping[str, str], env: Mapping[str, str]) -> dict[str, str]:
    """Variables of uv's environment that say what pip is configured with; those that are set already stay."""
    named = {UV_NAMES[name]: ' '.join(value.split()) for name, value in settings.items() if name in UV_NAMES}
    return {name: value for name, value in named.items() if name not in env}


def uv_cache(env: Mapping[str, str]) -> Path:
    """Where uv keeps what it has downloaded."""
    return Path(env.get('UV_CACHE_DIR') or Path(env.get('XDG_CACHE_HOME') or Path('~/.cache').expanduser(), 'uv'))


def _may_write(directory: Path) -> bool:
    """Whether a directory can be written, or made where it is missing."""
    nearest = next(path for path in (directory, *directory.absolute().parents) if path.exists())
    return os.access(nearest, os.W_OK)


def pip_settings(shell: Shell, python: Path) -> dict[str, str]:
    """Option -> value of the user's pip configuration, as `pip config list` shows it."""
    listed = shell.try_run([python, '-m', 'pip', 'config', 'list'])[1]
    found = {}
    for line in listed.splitlines():
        key, equals, value = line.partition('=')
        if equals:
            found[key.rsplit('.', 1)[-1]] = value.strip().strip('\'"').replace('\\n', ' ')
    return found


def check_sourced_ros(shell: Shell) -> None:
    """Try the sourced ROS before anything is made for it.

    Raises:
        SetupError: it does not load.
    """
    code, output = shell.try_run([base_python(), '-c', 'import rclpy'], os.environ)
    if code:
        number = f'{sys.version_info.major}.{sys.version_info.minor}'
        problem = (output.strip().splitlines() or [f'exit code {code}'])[-1]
        raise SetupError(
            f"ROS 2 Jazzy is sourced ('ros2' is {shutil.which('ros2')}), but rclpy does not load in Python {number} "
            f'({problem}): source its setup.bash again, name its own Python by make PYTHON=/usr/bin/python3, '
            'or unset ROS_DISTRO, and set-up brings its own ROS'
        )


def _name_this_python(shell: Shell, place: Place) -> None:
    """Let the wheels' CMake files name this environment's Python and numpy."""
    ask = 'import sysconfig, numpy; print(sysconfig.get_paths()["include"]); print(numpy.get_include())'
    output = shell.run('asking Python for its paths', [place.venv / 'bin' / 'python', '-c', ask])
    python, numpy = output.splitlines()[-2:]
    headers = place.headers() or python
    for path in (place.venv / 'share').rglob('*.cmake'):
        text = path.read_text(encoding='utf-8')
        # Functions, since a path may hold what a replacement text means something by.
        ours = BUILDER_PYTHON.sub(lambda _: headers, BUILDER_NUMPY.sub(lambda _: numpy, text))
        if ours != text:
            path.unlink()  # The file may be shared with the installer's cache: never write into it.
            path.write_text(ours, encoding='utf-8')


def _find_headers(shell: Shell, place: Place) -> None:
    """Fetch the distribution's header files of Python where they are not installed; no root is needed for that.

    Raises:
        SetupError: they are missing and cannot be fetched.
    """
    if prerequisites.has_headers():
        return
    shell.say('header files of Python, which are not installed here')
    place.headers_root.mkdir()
    package = f'libpython{sys.version_info.major}.{sys.version_info.minor}-dev'
    fetch = f'cd {shlex.quote(str(place.headers_root))} && apt-get download {package} && dpkg-deb -x {package}_*.deb .'
    code, _ = shell.try_run(['sh', '-c', fetch])
    if code or not place.headers():
        prerequisites.refuse([prerequisites.headers_missing()])
