"""What decides the last bits of a result: the cores' code, versions of the numeric packages and the kind of machine."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import advise_ros
from advise_ros.recording.code_digest import core_digest

NUMERIC_PACKAGES = ('numpy', 'scipy', 'highspy', 'scikit-learn', 'cvxpy', 'piqp', 'qdldl', 'clarabel')
CPU_INFO = Path('/proc/cpuinfo')


def describe() -> dict[str, str]:
    """Name -> text: advise_ros, core, python, system, machine, cpu and the numeric packages ('' when missing).

    `core` is a digest of its code without comments: between two releases the version alone does not identify what was run.
    """
    return dict(_described())


@cache
def _described() -> dict[str, str]:
    return {
        'advise_ros': advise_ros.__version__,
        'core': core_digest(),
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


# The prefix before a node's name: the parameters that it was started with, each as JSON.
PARAMETERS_RECORD = 'parameters '
# What the recording was made on (recording/platform.py).
PLATFORM_RECORD = 'platform'
# Topic -> type of what others published and the logger was not asked for.
LEFT_OUT_RECORD = 'not recorded'
# In a record of parameters, when they were read (the logger's clock): a node may be started again with others. Bags of
# earlier versions do not hold it.
READ_AT = 'log time (ns)'
