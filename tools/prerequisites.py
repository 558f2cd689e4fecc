"""What set-up needs of the machine. Each thing that lacks is one sentence with its remedy."""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import sys
from pathlib import Path

NEEDED_BYTES = 2_500_000_000
GLIBC = (2, 28)


class SetupError(Exception):
    """One sentence for the person at the terminal."""


def check(root: Path) -> None:
    """All that can be known before anything is downloaded.

    Raises:
        SetupError: something lacks.
    """
    _check_machine()
    check_python()
    _check_compiler()
    _check_disk(root)


def _check_machine() -> None:
    system, machine = platform.system(), platform.machine()
    if (system, machine) != ('Linux', 'x86_64'):
        raise SetupError(
            f'this machine is {system} {machine}, and the ROS 2 wheels exist for Linux x86_64 only; '
            'source a full ROS 2 Jazzy installation (ROS_DISTRO=jazzy) and run this again'
        )
    library, version = platform.libc_ver()
    if library != 'glibc' or tuple(int(part) for part in version.split('.')[:2]) < GLIBC:
        raise SetupError(
            f'the C library here is {library or "not glibc"} {version}, and glibc 2.28 or newer is needed; '
            'use Debian 12 or Ubuntu 22.04 or newer'
        )


def check_python() -> None:
    number = f'{sys.version_info.major}.{sys.version_info.minor}'
    if not (3, 10) <= sys.version_info[:2] <= (3, 13):
        raise SetupError(f'this is Python {number}, and 3.10 to 3.13 is needed; name one by make PYTHON=python3.12')
    if any(importlib.util.find_spec(module) is None for module in ('venv', 'ensurepip')):
        raise SetupError(f"Python {number} has no 'venv' module: sudo apt install python{number}-venv")


def _check_compiler() -> None:
    for variable, usual in (('CC', 'cc'), ('CXX', 'c++')):
        command = os.environ.get(variable, usual).split()[0]
        if shutil.which(command) is None:
            raise SetupError(f"no C and C++ compiler was found ('{command}' is not there): sudo apt install build-essential")


def _check_disk(root: Path) -> None:
    free = shutil.disk_usage(root).free
    if free < NEEDED_BYTES:
        raise SetupError(
            f'the disk of {root} has {free / 1e9:.1f} GB left, and set-up takes up to {NEEDED_BYTES / 1e9:.1f} GB; free some'
        )


def reason(output: str) -> str | None:
    """What a failed command's output means, in one sentence, or None when it is none of the known causes."""
    lowered = output.lower()
    if 'no space left on device' in lowered or 'disk quota exceeded' in lowered:
        return 'the disk is full; free some space and run this again'
    if unreachable(output) or any(sign in lowered for sign in NOT_OFFERED):
        return 'a package could not be downloaded; check the network (and the proxy or index settings of pip) and run this again'
    if 'hash' in lowered and 'mismatch' in lowered:
        return 'a downloaded package is not the one that requirements/lock.txt names; check the index settings of pip'
    if 'python.h: no such file' in lowered or 'python3_include_dir' in lowered:
        return python_headers()
    return None


def unreachable(output: str) -> bool:
    """True when a command failed because it could not reach the package index."""
    return any(sign in output.lower() for sign in NO_CONNECTION)


def python_headers() -> str:
    number = f'{sys.version_info.major}.{sys.version_info.minor}'
    return f'the header files of Python {number} are missing: sudo apt install python{number}-dev'


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
