"""The file of what a simulated person wants beside the map: YAML with `keep_out`, cells as [x, y] like `blocked` in a grid file.

Only simulated people read it; the learner never does.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.recording.gridfile import cells_of, read_yaml

EXAMPLE = 'see config/garden.yaml for one that works'


def load_wish(path: str | Path, grid: Grid) -> tuple[int, ...]:
    """Cells that a person wants kept out of, ascending; none where no file is named.

    Raises:
        InputError: the file is missing or no YAML, has another key than `keep_out`, or names a cell off the grid, a waypoint, or
            so many cells that no way is left; one sentence with file, value and remedy.
    """
    if not str(path):
        return ()
    try:
        return _checked(_cells(read_yaml(Path(path), f'keep_out, {EXAMPLE}'), grid), grid)
    except InputError as problem:
        raise InputError(f'wish file {path}: {problem}') from problem


def _cells(document: object, grid: Grid) -> tuple[int, ...]:
    if not isinstance(document, dict) or 'keep_out' not in document:
        raise InputError(f"it has no key 'keep_out'; {EXAMPLE}")
    for key in document:
        if key != 'keep_out':
            raise InputError(f"key '{key}' is unknown beside 'keep_out'; drop it")
    return tuple(sorted(set(cells_of('keep_out', document['keep_out'], grid.width, grid.height))))


def _checked(cells: tuple[int, ...], grid: Grid) -> tuple[int, ...]:
    """The cells, if a route over all waypoints is left."""
    for number, cell in enumerate(grid.waypoints, start=1):
        if cell in cells:
            raise InputError(f'cell to keep out of {list(grid.xy(cell))} is waypoint {number} of the grid; take it out')
    try:
        replace(grid, blocked=(*grid.blocked, *cells))
    except InputError:
        raise InputError(
            f'no way round is left between the waypoints; take some of the {len(cells)} cells to keep out of out'
        ) from None
    return cells
