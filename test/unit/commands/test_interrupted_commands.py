"""Ctrl-C ends a command by the shell's code for it, without a traceback, and leaves no half results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest

from advise_ros.commands import answer, discretise, replay, site_map
from support.paths import ROOT

GRID = str(ROOT / 'config' / 'grid_6x6.yaml')
Run = Callable[[list[str]], int]


def interrupted(*_: object, **__: object) -> NoReturn:
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ('run', 'work', 'words'),
    [
        (discretise.run, (discretise, 'read_one'), ['flight.tlog', '--grid', GRID, '--out', '{tmp}/demos.json']),
        (replay.run, (replay, 'check'), ['bag', '--json', '{tmp}/verdict.json']),
        (site_map.run, (site_map, 'read_session'), ['bag', '--out', '{tmp}/site.yaml']),
        (answer.run, (answer, '_answer'), ['--undo']),
    ],
)
def test_an_interruption_is_no_traceback(
    run: Run, work: tuple[object, str], words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(*work, interrupted)
    assert run([word.format(tmp=tmp_path) for word in words]) == 130
    assert not list(tmp_path.iterdir())
