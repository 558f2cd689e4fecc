"""Whether requirements/system-lock.txt can be installed without a compiler on the machines that it is for, asked of the resolver.

`make lint` runs it; nothing is installed, and only the package index is asked.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from packages import pip_settings, uv_settings
from shell import Shell

ROOT = Path(__file__).resolve().parent.parent
# Ubuntu 24.04 has Python 3.12, Debian 12 has 3.11; companion computers are aarch64.
PYTHONS, MACHINES = ('3.11', '3.12'), ('aarch64-manylinux_2_35', 'x86_64-manylinux_2_35')


def main() -> int:
    """0 where all can be installed."""
    shell, python = Shell(ROOT, ROOT / 'log' / 'check_locks.log'), ROOT / '.venv' / 'bin' / 'python'
    env = {**shell.env, **uv_settings(pip_settings(shell, python), shell.env)}
    wrong = 0
    with tempfile.TemporaryDirectory() as nowhere:
        for version in PYTHONS:
            for machine in MACHINES:
                where = ['--python-version', version, '--python-platform', machine, '--target', nowhere, '--only-binary', ':all:']
                uv = [python.with_name('uv'), 'pip', 'install', '--dry-run', '--no-config', *where, '--require-hashes']
                code, output = shell.try_run([*uv, '-r', ROOT / 'requirements' / 'system-lock.txt'], env)
                if code:
                    wrong = 1
                    print(f'requirements/system-lock.txt: Python {version} on {machine}: {output.strip()}', file=sys.stderr)
    return wrong


if __name__ == '__main__':
    sys.exit(main())
