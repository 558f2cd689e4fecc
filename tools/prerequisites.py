"""What set-up needs of the machine: all that is missing in one sentence, with one line that installs it."""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import string
import sys
import sysconfig
from pathlib import Path
from typing import NamedTuple

NEEDED_BYTES = 2_500_000_000
GLIBC = (2, 28)
# ROS's build tools are known to work in paths of these. Others end a path for CMake, make, a shell or a list of paths.
HARMLESS_IN_PATH = string.ascii_letters + string.digits + '/ ._-'


class SetupError(Exception):
    """One sentence for the person at the terminal."""


class Missing(NamedTuple):
    """What set-up needs and has not.

    Attributes:
        what: in words.
        package: of Debian and Ubuntu that brings it; '' when no package does, and `what` says the remedy.
    """

    what: str
    package: str = ''


def check(root: Path) -> None:
    """All that can be known before anything is downloaded.

    Raises:
        SetupError: something is missing; the sentence names all of it.
    """
    refuse([*_machine(), *python(), *_compiler(), *_headers(), *_path(root), *_disk(root)])


def check_beside_ros(root: Path) -> None:
    """The same beside a full ROS 2 installation, which has brought what a build needs.

    Raises:
        SetupError: something is missing; the sentence names all of it.
    """
    colcon = [] if shutil.which('colcon') else [Missing("'colcon'", 'python3-colcon-common-extensions')]
    refuse([*python(), *colcon, *_path(root), *_disk(root)])


def refuse(missing: list[Missing]) -> None:
    """Say what is missing, if anything is.

    Raises:
        SetupError: something is.
    """
    if not missing:
        return
    by_package = [item for item in missing if item.package]
    parts = [item.what for item in missing if not item.package]
    if by_package:
        named = ' and '.join([', '.join(item.what for item in by_package[:-1]), by_package[-1].what]).removeprefix(' and ')
        parts.append(f'set-up needs {named}: {apt_install(*(item.package for item in by_package))}')
    raise SetupError('; '.join(parts))


def apt_install(*packages: str) -> str:
    """The line that installs packages, each once."""
    return f'{"" if os.geteuid() == 0 else "sudo "}apt install {" ".join(dict.fromkeys(packages))}'


def _machine() -> list[Missing]:
    system, machine = platform.system(), platform.machine()
    if (system, machine) != ('Linux', 'x86_64'):
        return [Missing(
            f'this machine is {system} {machine}, and the ROS 2 wheels exist for Linux x86_64 only; '
            'source a full ROS 2 Jazzy installation (ROS_DISTRO=jazzy) and run this again'
        )]
    library, version = platform.libc_ver()
    if library != 'glibc' or tuple(int(part) for part in version.split('.')[:2]) < GLIBC:
        return [Missing(
            f'the C library here is {library or "not glibc"} {version}, and glibc 2.28 or newer is needed; '
            'use Debian 12 or Ubuntu 22.04 or newer'
        )]
    return []


def python() -> list[Missing]:
    """What this Python lacks."""
    number = f'{sys.version_info.major}.{sys.version_info.minor}'
    if not (3, 10) <= sys.version_info[:2] <= (3, 13):
        return [Missing(f'this is Python {number}, and 3.10 to 3.13 is needed; name one by make PYTHON=python3.12')]
    if any(importlib.util.find_spec(module) is None for module in ('venv', 'ensurepip')):
        return [Missing(f"the 'venv' module of Python {number}", f'python{number}-venv')]
    return []


def _compiler() -> list[Missing]:
    commands = [os.environ.get(variable, usual).split()[0] for variable, usual in (('CC', 'cc'), ('CXX', 'c++'))]
    absent = ' and '.join(f"'{command}'" for command in commands if shutil.which(command) is None)
    return [Missing(f'a C and C++ compiler ({absent} not there)', 'build-essential')] if absent else []


def has_headers() -> bool:
    """Whether Python's header files are installed."""
    return Path(sysconfig.get_paths()['include'], 'Python.h').exists()


def _headers() -> list[Missing]:
    """Header files are fetched where the distribution's tools for that are there."""
    return [] if has_headers() or (shutil.which('apt-get') and shutil.which('dpkg-deb')) else [headers_missing()]


def headers_missing() -> Missing:
    number = f'{sys.version_info.major}.{sys.version_info.minor}'
    return Missing(f'the header files of Python {number}', f'python{number}-dev')


def _path(root: Path) -> list[Missing]:
    bad = sorted(set(str(root)) - set(HARMLESS_IN_PATH))
    if not bad:
        return []
    return [Missing(
        f'the path {str(root)!r} holds {" and ".join(map(repr, bad))}, which ROS\'s build tools take for something else: '
        "move the checkout to a path of ASCII letters, digits, spaces and '._-'"
    )]


def _disk(root: Path) -> list[Missing]:
    free = shutil.disk_usage(root).free
    if free >= NEEDED_BYTES:
        return []
    return [Missing(
        f'the disk of {root} has {free / 1e9:.1f} GB left, and set-up takes up to {NEEDED_BYTES / 1e9:.1f} GB: free some'
    )]


def reason(output: str) -> str | None:
    """What a failed command's output means, in one sentence, or None when it is none of the known causes."""
    lowered = output.lower()
    if 'no space left on device' in lowered or 'disk quota exceeded' in lowered:
        return 'the disk is full; free some space and run this again'
    if 'certificate' in lowered and any(sign in lowered for sign in NOT_TRUSTED):
        return (
            'the certificate of the package index is not trusted here; where a proxy signs it, name its authority by '
            'PIP_CERT=FILE and SSL_CERT_FILE=FILE, and check the clock of this machine'
        )
    if unreachable(output) or any(sign in lowered for sign in NOT_OFFERED):
        return 'a package could not be downloaded; check the network (and the proxy or index settings of pip) and run this again'
    if 'hash' in lowered and 'mismatch' in lowered:
        return 'a downloaded package is not the one that requirements/lock.txt names; check the index settings of pip'
    if 'python.h: no such file' in lowered or 'python3_include_dir' in lowered:
        what, package = headers_missing()
        return f'{what} are missing: {apt_install(package)}'
    return None


def unreachable(output: str) -> bool:
    """True when a command failed because it could not reach the package index, or may not trust it."""
    return any(sign in output.lower() for sign in (*NO_CONNECTION, *NOT_TRUSTED))


NOT_TRUSTED = ('certificate_verify_failed', 'certificate verify failed', 'invalid peer certificate', 'unknownissuer')
NOT_OFFERED = ('no matching distribution found', 'could not find a version that satisfies')
NO_CONNECTION = (
    'temporary failure in name resolution',
    'name or service not known',
    'failed to establish a new connection',
    'network is unreachable',
    'connection refused',
    'connection reset',
    'connection timed out',
    'read timed out',
    'dns error',
    'error sending request',
    'failed to fetch',
    'cannot connect to proxy',
    'proxyerror',
)
