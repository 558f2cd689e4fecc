"""What decides the last bits of a result: the cores' code, versions of the numeric packages and the kind of machine."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import advise_ros
from advise_ros.recording import source_digest

NUMERIC_PACKAGES = ('numpy', 'scipy', 'highspy', 'scikit-learn', 'cvxpy', 'piqp', 'qdldl', 'clarabel')
CORE = Path(__file__).parents[1] / 'core'
CPU_INFO = Path('/proc/cpuinfo')


def describe() -> dict[str, str]:
    """Name -> text: advise_ros, core, python, system, machine, cpu and the numeric packages ('' when missing).

    `core` is a digest of its code without comments: between two releases the version alone does not tell what was run.
    """
    return dict(_described())


@cache
def _described() -> dict[str, str]:
    return {
        'advise_ros': advise_ros.__version__,
        'core': source_digest.of_directory(CORE),
        'python': platform.python_version(),
        'system': platform.system(),
        'machine': platform.machine(),
        'cpu': _cpu_model(),
        **{name: _version(name) for name in NUMERIC_PACKAGES},
    }


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ''


def _cpu_model() -> str:
    """Model of the first core and a digest of what it can do; numeric libraries pick their kernels by that.

    A virtual machine's model may be no more than its maker's name, on hosts of several generations.
    """
    try:
        lines = CPU_INFO.read_text(encoding='utf-8', errors='replace').splitlines()
    except OSError:
        return platform.processor()
    said = {name.strip(): value.strip() for name, _, value in (line.partition(':') for line in reversed(lines))}
    abilities = said.get('flags', said.get('Features', ''))
    return f"{said.get('model name', platform.processor())} {hashlib.sha256(abilities.encode()).hexdigest()[:8]}"
