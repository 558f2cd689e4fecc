"""In which values two grids differ, in words."""

from __future__ import annotations

from advise_ros.core.grid.grid import Grid

# Of a longer list of cells the first ones are named.
CELLS_NAMED = 8


def what_differs(there: Grid, here: Grid) -> str:
    """Every value that is not the same, with both: 'resolution 2.0 m there and 1.0 m here, ...'; '' where nothing differs.

    Args:
        there: of the thing that is refused.
        here: the grid in use.
    """
    names = {
        'resolution': [f'{grid.resolution_m} m' for grid in (there, here)],
        'size': [f'{grid.width} x {grid.height} cells' for grid in (there, here)],
        'origin': [f'{list(grid.origin_enu_m)} m' for grid in (there, here)],
        'altitude': [f'{grid.altitude_m} m' for grid in (there, here)],
        'waypoints': [str([list(grid.xy(cell)) for cell in grid.waypoints]) for grid in (there, here)],
        'blocked cells': [_blocked(there, here), _blocked(here, there)] if there.blocked != here.blocked else ['', ''],
    }
    return ', '.join(f'{name} {one} there and {other} here' for name, (one, other) in names.items() if one != other)


def _blocked(grid: Grid, other: Grid) -> str:
    """How many, and the first ones that the other grid does not have at the same place."""
    others = {other.centre_enu_m(cell) for cell in other.blocked}
    own = [list(grid.xy(cell)) for cell in grid.blocked if grid.centre_enu_m(cell) not in others]
    if not own:
        return f'{len(grid.blocked)}'
    more = ', ...' if len(own) > CELLS_NAMED else ''
    return f'{len(grid.blocked)} ({str(own[:CELLS_NAMED])[1:-1]}{more} only)'
