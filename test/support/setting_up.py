"""Set-up's own modules and what its tests try them on."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from support.paths import ROOT

MODULES = ('prerequisites', 'shell', 'places', 'packages', 'build', 'setup_env')


@pytest.fixture
def tools(monkeypatch: pytest.MonkeyPatch) -> Iterator[SimpleNamespace]:
    """The modules of tools/, imported as set-up imports them."""
    monkeypatch.syspath_prepend(str(ROOT / 'tools'))
    yield SimpleNamespace(**{name: importlib.import_module(name) for name in MODULES})
    for name in MODULES:
        sys.modules.pop(name, None)


def run(*command: str, **env: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=ROOT, env={**os.environ, **env}, text=True, capture_output=True, check=False)


def command(folder: Path, name: str, body: str) -> None:
    """A command of the shell."""
    path = folder / name
    path.write_text(f'#!/bin/sh\n{body}\n')
    path.chmod(0o755)


def place_in(tools: SimpleNamespace, folder: Path) -> Any:
    place = tools.places.Place(folder / 'place')
    place.path.mkdir()
    return place


def used_place(tools: SimpleNamespace, root: Path) -> tuple[Any, Any]:
    """An environment in use, with a file in it."""
    places = tools.places.Places(root)
    place = places.new()
    for folder in (place.venv, place.build, place.install):
        folder.mkdir()
    (place.venv / 'kept').touch()
    places.use(place)
    (root / '.built' / 'COLCON_IGNORE').unlink()
    return place, places
