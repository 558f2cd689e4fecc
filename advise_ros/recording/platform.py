"""What decides the last bits of a result: the cores' code, versions of the numeric packages and the kind of machine."""

from __future__ import annotations

import ast
import hashlib
import io
import platform
import tokenize
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import advise_ros

NUMERIC_PACKAGES = ('numpy', 'scipy', 'highspy', 'scikit-learn', 'cvxpy', 'piqp', 'qdldl', 'clarabel')
CORE = Path(__file__).parents[1] / 'core'
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
        'core': digest_of_code(CORE),
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


DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
DIGITS = 16


def digest_of_code(directory: Path) -> str:
    """DIGITS hexadecimal digits for the code of all modules below a directory and their paths in it."""
    found = hashlib.sha256()
    for file in sorted(directory.rglob('*.py')):
        found.update(file.relative_to(directory).as_posix().encode() + b'\0' + _code(file.read_text(encoding='utf-8')).encode())
    return found.hexdigest()[:DIGITS]


def _code(source: str) -> str:
    """The lines of a module that do something, without the comments at their ends."""
    lines = source.splitlines()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            row, column = token.start
            lines[row - 1] = lines[row - 1][:column]
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            text = node.body[0]
            lines[text.lineno - 1 : text.end_lineno] = [''] * ((text.end_lineno or text.lineno) - text.lineno + 1)
    return '\n'.join(line.rstrip() for line in lines if line.strip())
