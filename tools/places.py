"""Where environments lie: each whole one in a place of its own, and `.venv`, `build` and `install` name the one in use.

A new environment is made beside the one in use and takes over by two renames when it is whole. What fails or is
interrupted before that leaves the one in use as it was; its half-made place is swept away by the next set-up.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

NAMES = {'.venv': 'venv', 'build': 'build', 'install': 'install'}


class Place:
    """One environment: its virtual environment, its build and what is installed."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.venv, self.build, self.install = path / 'venv', path / 'build', path / 'install'
        self.headers_root = path / 'headers'
        self.scratch = path / 'tmp'

    def headers(self) -> str:
        """Directory of Python.h that set-up fetched, or '' when Python has its own."""
        found = sorted(self.headers_root.glob('usr/include/python3*/Python.h'))
        return str(found[0].parent) if found else ''


class Places:
    """All environments of a checkout."""

    def __init__(self, root: Path) -> None:
        self._root = root.resolve()
        self._all = self._root / '.built'

    def in_use(self) -> Place | None:
        """The environment that `.venv` names, or None when there is none of ours."""
        link = self._root / '.venv'
        return Place(link.resolve().parent) if link.is_symlink() and link.resolve().parent.parent == self._all else None

    def new(self) -> Place:
        """An empty place; half-made ones go first, since each takes more than a gigabyte."""
        self.sweep()
        used = self.in_use()
        place = Place(self._all / ('2' if used is not None and used.path.name == '1' else '1'))
        place.scratch.mkdir(parents=True)
        (self._all / 'COLCON_IGNORE').touch()  # Else colcon takes the wheels' package.xml files for sources.
        return place

    def sweep(self) -> None:
        """Remove every place that is not in use."""
        used = self.in_use()
        for path in sorted(self._all.glob('*')) if self._all.is_dir() else []:
            if path.is_dir() and (used is None or path != used.path):
                shutil.rmtree(path)

    def use(self, place: Place) -> None:
        """Let a whole environment take over."""
        shutil.rmtree(place.scratch, ignore_errors=True)
        for name, inside in NAMES.items():
            _point(self._root / name, Path(os.path.relpath(place.path / inside, self._root)))
        self.sweep()


def _point(link: Path, target: Path) -> None:
    """Make a name a link to another directory, in one step where it is a link already."""
    fresh = link.with_name(f'{link.name}.new')
    fresh.unlink(missing_ok=True)
    fresh.symlink_to(target)
    if link.is_dir() and not link.is_symlink():  # Of an older set-up.
        shutil.rmtree(link)
    fresh.replace(link)
