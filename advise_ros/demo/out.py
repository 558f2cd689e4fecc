"""The directory of a run's results; a run that is refused leaves nothing of it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from advise_ros.core.errors import InputError

MIB = 1 << 20
# A run writes about 20 MiB; the logger stops when its disk has less than its own limit left.
NEEDED_MIB = 100


def refuse_what_holds_something(out: Path) -> None:
    """Results of two runs are not mixed.

    Raises:
        InputError: `out` is a file, or a directory that is not empty.
    """
    if out.exists() and not out.is_dir():
        raise InputError(f'{out} is a file; name a new directory by --out')
    if out.exists() and any(out.iterdir()):
        raise InputError(f'{out} holds something already; name another directory by --out')


def refuse_a_full_disk(out: Path, reserve_mib: int, option: str = '--out') -> None:
    """A run whose bag would end early does not begin.

    Args:
        out: directory to be made.
        reserve_mib: what the logger leaves free.
        option: that names the directory.

    Raises:
        InputError: too little is free on its disk.
    """
    there = next(path for path in (out, *out.absolute().parents) if path.exists())
    free = shutil.disk_usage(there).free // MIB
    if free < NEEDED_MIB + reserve_mib:
        raise InputError(
            f'the disk of {out} has {free} MiB left, and a run needs {NEEDED_MIB + reserve_mib}; '
            f'free some, or name a directory on another disk by {option}'
        )


@contextmanager
def out_directory(out: Path) -> Iterator[None]:
    """Make a directory of results; when the run is refused, everything that it made is removed again.

    Raises:
        InputError: it cannot be made, or whatever the run was refused for.
    """
    made = [path for path in (out, *out.parents) if not path.exists()]
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise InputError(f'{out} cannot be made ({problem.strerror}); name a directory that you may write by --out') from None
    try:
        yield
    except InputError:
        for path in out.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        for path in made:
            path.rmdir()
        raise
