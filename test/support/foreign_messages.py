"""Messages of other packages for tests: their definitions in test/, built once and again when one changes.

The product has none of them: they are the user's.
"""

from __future__ import annotations

import ctypes
import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from support.paths import ROOT

# Debug information and optimising are half of the time; nothing here is in a hurry.
SETTINGS = {'BUILD_TESTING': 'OFF', 'CMAKE_BUILD_TYPE': 'None', 'CMAKE_C_FLAGS': '-O0', 'CMAKE_CXX_FLAGS': '-O0'}


class ForeignMessages:
    """One package of messages.

    Args:
        package: its name.
        source: folder of its definitions.
    """

    def __init__(self, package: str, source: Path) -> None:
        self._package, self._source, self._built = package, source, ROOT / 'build' / f'test_{package}'

    def prefix(self) -> Path:
        """Where the package is installed; one process builds it, the others wait for it."""
        files = sorted(path for path in self._source.rglob('*') if path.is_file())
        wanted = hashlib.sha256(b'\0'.join([sys.version.encode(), *(path.read_bytes() for path in files)])).hexdigest()
        self._built.mkdir(parents=True, exist_ok=True)
        stamp = self._built / 'stamp'
        with (self._built / 'lock').open('w') as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not stamp.exists() or stamp.read_text() != wanted:
                stamp.unlink(missing_ok=True)
                self._build()
                stamp.write_text(wanted)
        return self._there

    @property
    def _there(self) -> Path:
        return self._built / 'install'

    def _build(self) -> None:
        work = self._built / 'work'
        shutil.rmtree(work, ignore_errors=True)  # Of other definitions, or of a checkout that was elsewhere.
        own = {'CMAKE_INSTALL_PREFIX': self._there, 'CMAKE_INSTALL_RPATH': self._there / 'lib'}
        settings = [f'-D{name}={value}' for name, value in {**SETTINGS, **own}.items()]
        for command in (
            ['cmake', '-S', self._source, '-B', work, *settings], ['cmake', '--build', work, '--parallel', '2'],
            ['cmake', '--install', work],
        ):
            done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
            assert done.returncode == 0, f'{done.stdout[-3000:]}\n{done.stderr[-3000:]}'

    def environment(self, env: Mapping[str, str]) -> dict[str, str]:
        """An environment of a process with the package in it."""
        there = self.prefix()
        places = {'AMENT_PREFIX_PATH': there, 'LD_LIBRARY_PATH': there / 'lib', 'PYTHONPATH': _modules(there)}
        return {**env, **{name: os.pathsep.join(filter(None, (str(place), env.get(name, '')))) for name, place in places.items()}}

    def load(self) -> None:
        """Let this process import the package, which its environment did not know when it began."""
        there = self.prefix()
        if str(_modules(there)) not in sys.path:
            sys.path.insert(0, str(_modules(there)))
            for library in sorted((there / 'lib').glob(f'lib{self._package}__*.so')):
                ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)


def _modules(there: Path) -> Path:
    return next(there.glob('lib/python3*/site-packages'))


PX4 = ForeignMessages('px4_msgs', ROOT / 'test' / 'px4_definitions')
GEOGRAPHIC = ForeignMessages('geographic_msgs', ROOT / 'test' / 'geographic_definitions')
