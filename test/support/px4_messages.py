"""px4_msgs for tests: test/px4_definitions, built once and again when a definition changes.

The product has none: px4_msgs is the user's.
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

SOURCE, BUILT = ROOT / 'test' / 'px4_definitions', ROOT / 'build' / 'test_px4_msgs'
PREFIX = BUILT / 'install'
# Debug information and optimising are half of the time; nothing here is in a hurry.
SETTINGS = {
    'CMAKE_INSTALL_PREFIX': PREFIX, 'CMAKE_INSTALL_RPATH': PREFIX / 'lib', 'BUILD_TESTING': 'OFF', 'CMAKE_BUILD_TYPE': 'None',
    'CMAKE_C_FLAGS': '-O0', 'CMAKE_CXX_FLAGS': '-O0',
}


def prefix() -> Path:
    """Where the package is installed; one process builds it, the others wait for it."""
    files = sorted(path for path in SOURCE.rglob('*') if path.is_file())
    wanted = hashlib.sha256(b'\0'.join([sys.version.encode(), *(path.read_bytes() for path in files)])).hexdigest()
    BUILT.mkdir(parents=True, exist_ok=True)
    stamp = BUILT / 'stamp'
    with (BUILT / 'lock').open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not stamp.exists() or stamp.read_text() != wanted:
            stamp.unlink(missing_ok=True)
            _build()
            stamp.write_text(wanted)
    return PREFIX


def _build() -> None:
    work = BUILT / 'work'
    shutil.rmtree(work, ignore_errors=True)  # Of other definitions, or of a checkout that was elsewhere.
    settings = [f'-D{name}={value}' for name, value in SETTINGS.items()]
    for command in (
        ['cmake', '-S', SOURCE, '-B', work, *settings], ['cmake', '--build', work, '--parallel', '2'],
        ['cmake', '--install', work],
    ):
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
        assert done.returncode == 0, f'{done.stdout[-3000:]}\n{done.stderr[-3000:]}'


def environment(env: Mapping[str, str]) -> dict[str, str]:
    """An environment of a process with px4_msgs in it."""
    there = prefix()
    places = {'AMENT_PREFIX_PATH': there, 'LD_LIBRARY_PATH': there / 'lib', 'PYTHONPATH': _modules(there)}
    return {**env, **{name: os.pathsep.join(filter(None, (str(place), env.get(name, '')))) for name, place in places.items()}}


def load() -> None:
    """Let this process import px4_msgs, which its environment did not know when it began."""
    there = prefix()
    if str(_modules(there)) not in sys.path:
        sys.path.insert(0, str(_modules(there)))
        for library in sorted((there / 'lib').glob('libpx4_msgs__*.so')):
            ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)


def _modules(there: Path) -> Path:
    return next(there.glob('lib/python3*/site-packages'))
