"""Recorded flights through the learner: what it believes of the site without an answer, and what it would fly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from advise_ros.core.advice.state import advice_state
from advise_ros.core.demonstrations.demonstration import Demonstration, count
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.learner import learn
from advise_ros.core.people.known_site import judge, site_with
from advise_ros.core.site import within_advise
from advise_ros.recording.batch import ReadTask, read_one
from advise_ros.recording.gridfile import load_grid
from advise_ros.recording.sources import find_recordings

# A cell is called keep-out from this probability on.
BELIEVED = 0.5
HEAD = (
    'recording', 'grid', 'flights', 'moves', 'flown as by', 'keep-out cells', 'reaches all', 'steps', 'shortest', 'best question',
)


def recordings(directory: Path, grid_files: Sequence[Path]) -> str:
    """Markdown: a line a recording, on the first grid that its flights lie on.

    Args:
        directory: of recordings.
        grid_files: of the grids and routes that they fly.

    Raises:
        InputError: there are no recordings, or a grid file is wrong.
    """
    if not directory.is_dir():
        raise InputError(f'{directory} is no directory of recordings; name another')
    grids = {path.stem: load_grid(path) for path in grid_files}
    lines = [_line(path, grids) for path in find_recordings(directory)]
    return '\n'.join(f'| {" | ".join(line)} |' for line in (HEAD, ('---',) * len(HEAD), *lines))


def _line(path: Path, grids: Mapping[str, Grid]) -> tuple[str, ...]:
    found = {name: read_one(str(path), ReadTask(grid)) for name, grid in grids.items()}
    for name, one in found.items():
        if one.demonstrations:
            return (path.name, name, *_learnt(grids[name], one.demonstrations))
    reasons = '; '.join(f'{name}: {one.failure}' for name, one in found.items())
    return (path.name, reasons.replace('|', '/'), '0', *['-'] * (len(HEAD) - 3))


def _learnt(grid: Grid, flights: Sequence[Demonstration]) -> tuple[str, ...]:
    learnt = learn(grid, LearnSettings(acquisition='site'), tuple(flights), ())
    belief = within_advise.belief_of(grid, count(grid, flights), advice_state(()), learnt.settings.seed)
    believed = np.flatnonzero(belief.keep_out > BELIEVED).tolist()
    site = site_with(grid, np.zeros(grid.n_cells, dtype=np.uint8))
    flown = judge(site, learnt.greedy)
    return (
        str(len(flights)), str(sum(len(flight.states) for flight in flights)), belief.pilots[0].pilot.name,
        ' '.join(f'({x}, {y})' for x, y in map(grid.xy, believed)) or 'none', 'yes' if flown.arrives else 'no',
        f'{flown.length * site.steps:.0f}', str(site.steps), f'{learnt.doubt_left:.2f} steps',
    )
