"""Recorded flights through the learner: what it believes of the site without an answer, and what it would fly."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from advise_ros.core.advice.state import advice_state
from advise_ros.core.demonstrations.action_counts import count
from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.learning.learner import LearnSettings, learn
from advise_ros.core.site import within_advise
from advise_ros.experiments.sites import judge, site_with
from advise_ros.recording.batch import ReadTask, harvest
from advise_ros.recording.gridfile import load_grid
from advise_ros.recording.sources import find_recordings

# A cell is called keep-out from this probability on.
BELIEVED = 0.5
HEAD = ('recording', 'flights', 'moves', 'flown as by', 'keep-out cells', 'reaches all', 'steps', 'shortest', 'best question')


def recordings(directory: Path, grid_file: Path) -> str:
    """Markdown: a line a recording.

    Args:
        directory: of recordings.
        grid_file: of the grid and route that all of them fly.

    Raises:
        InputError: there are no recordings, or the grid file is wrong.
    """
    if not directory.is_dir():
        raise InputError(f'{directory} is no directory of recordings; name another')
    grid, lines = load_grid(grid_file), [HEAD, ('---',) * len(HEAD)]
    for path in find_recordings(directory):
        found = harvest(str(path), ReadTask(grid))
        name = path.name
        lines.append(_learnt(name, grid, found.demonstrations) if found.demonstrations else (name, '0', *['-'] * (len(HEAD) - 2)))
    return '\n'.join(f'| {" | ".join(line)} |' for line in lines)


def _learnt(name: str, grid: Grid, flights: Sequence[Demonstration]) -> tuple[str, ...]:
    learnt = learn(grid, LearnSettings(acquisition='site'), tuple(flights), ())
    belief = within_advise.belief_of(grid, count(grid, flights), advice_state(()), learnt.settings.seed)
    believed = np.flatnonzero(belief.keep_out > BELIEVED).tolist()
    site = site_with(grid, np.zeros(grid.n_cells, dtype=np.uint8))
    flown = judge(site, learnt.greedy.astype(np.int64))
    return (
        name, str(len(flights)), str(sum(len(flight.states) for flight in flights)), belief.pilots[0].pilot.name,
        ' '.join(f'({x}, {y})' for x, y in map(grid.xy, believed)) or 'none', 'yes' if flown.arrives else 'no',
        f'{flown.length * site.steps:.0f}', str(site.steps), f'{learnt.doubt_left:.2f} steps',
    )
