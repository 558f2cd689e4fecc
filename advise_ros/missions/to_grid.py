"""A mission on the earth -> a grid: cells around its route and areas, and what of it the grid cannot say."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.path import Path as Outline
from matplotlib.transforms import Bbox

from advise_ros.core.errors import InputError, LogError
from advise_ros.core.grid.grid import Grid
from advise_ros.missions.mission import EarthPosition, FlightMission, Ring
from advise_ros.recording.place import Place

Floats = npt.NDArray[np.float64]
# More cells than these are no grid that a person answers questions on.
MOST_CELLS = 10_000


@dataclass(frozen=True)
class GridOptions:
    """How the grid is laid.

    Attributes:
        cell_m: edge of a cell.
        altitude_m: flight altitude; None: the heights of the file.
        heading_deg: of the grid's y axis, clockwise from north; None: along the longest leg of the route.
        margin: cells around the route, where no area to stay in says how far it goes.
    """

    cell_m: float
    altitude_m: float | None = None
    heading_deg: float | None = 0.0
    margin: int = 2


class PlacedGrid(NamedTuple):
    """A grid, where it lies on the earth, and what is to be said about it."""

    grid: Grid
    place: Place
    notes: tuple[str, ...]


def grid_of(mission: FlightMission, options: GridOptions) -> PlacedGrid:
    """The grid of a mission: its waypoints in their cells, what may not be entered blocked.

    Raises:
        InputError: it has no waypoints or no height, or the cells are too small or too large for it.
    """
    if not mission.waypoints:
        raise InputError('it has no waypoints; draw a route (a line, or points in their order)')
    if not (math.isfinite(options.cell_m) and options.cell_m > 0):
        raise InputError(f'cells of {options.cell_m:g} m cannot be; they are a positive number of metres')
    notes: list[str] = []
    altitude_m = _altitude(mission.waypoints, options.altitude_m, notes)
    place = _place(mission, options.heading_deg)
    points = _on_grid(place, mission.waypoints)
    stay_in, keep_out = ([_on_grid(place, ring) for ring in rings] for rings in (mission.stay_in, mission.keep_out))
    lower, (width, height) = _extent(points, stay_in, options)
    waypoints = _waypoints(points, lower, (width, height), options.cell_m, notes)
    blocked = _blocked(stay_in, keep_out, lower, (width, height), options.cell_m)
    in_the_way = [number for number, cell in enumerate(waypoints, start=1) if cell in blocked]
    if in_the_way:
        raise InputError(
            f'waypoint {in_the_way[0]} lies in a cell that an area to keep out of touches, or that lies not wholly in one to '
            f'stay in; pass smaller cells than --cell {options.cell_m:g}, or move it'
        )
    grid = Grid(options.cell_m, width, height, (round(lower[0], 6), round(lower[1], 6)), altitude_m, waypoints, blocked)
    return PlacedGrid(_trimmed(grid), place, tuple(notes))


def _trimmed(grid: Grid) -> Grid:
    """The same without rows and columns at its border that are blocked from end to end."""
    free = np.ones((grid.height, grid.width), dtype=np.bool_)
    free.flat[list(grid.blocked)] = False
    rows, columns = np.flatnonzero(free.any(axis=1)), np.flatnonzero(free.any(axis=0))
    south, west, width, height = int(rows[0]), int(columns[0]), int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1

    def moved(cells: tuple[int, ...]) -> tuple[int, ...]:
        at = [(x - west, y - south) for x, y in map(grid.xy, cells)]
        return tuple(y * width + x for x, y in at if 0 <= x < width and 0 <= y < height)

    (east_m, north_m), cell_m = grid.origin_enu_m, grid.resolution_m
    origin = round(east_m + west * cell_m, 6), round(north_m + south * cell_m, 6)
    return Grid(cell_m, width, height, origin, grid.altitude_m, moved(grid.waypoints), moved(grid.blocked))


def _altitude(waypoints: tuple[EarthPosition, ...], asked: float | None, notes: list[str]) -> float:
    if asked is not None:
        return asked
    heights = Counter(round(one.height_m, 2) for one in waypoints if one.height_m is not None)
    if not heights:
        raise InputError('it says no height above the ground; pass one: --altitude 5')
    usual, count = heights.most_common(1)[0]
    if count < len(waypoints):
        notes.append(
            f'{len(waypoints) - count} of {len(waypoints)} waypoints have another height than {usual:g} m, or none; '
            'a grid is flown at one altitude (--altitude)'
        )
    return usual


def _place(mission: FlightMission, heading_deg: float | None) -> Place:
    origin = mission.home or mission.waypoints[0]
    at = round(origin.latitude_deg, 7), round(origin.longitude_deg, 7)
    if heading_deg is not None:
        return Place(*at, heading_deg)
    legs = np.diff(_on_grid(Place(*at), mission.waypoints), axis=0)
    if not len(legs):
        return Place(*at)
    east, north = legs[np.argmax(np.hypot(*legs.T))]
    # The axes may as well be turned by right angles: the turn that is nearest to north.
    turn = math.degrees(math.atan2(east, north))
    return Place(*at, round((turn + 45.0) % 90.0 - 45.0, 2))


def _on_grid(place: Place, positions: tuple[EarthPosition, ...] | Ring) -> Floats:
    """(n, 2) [m] along the grid's axes."""
    latitudes, longitudes = np.array([one[:2] for one in positions], dtype=np.float64).T
    try:
        return place.positions(latitudes, longitudes, np.zeros(len(positions)))[:, :2]
    except LogError:
        raise InputError('its waypoints lie 50 km and more from its home; set the home position there') from None


def _extent(points: Floats, stay_in: list[Floats], options: GridOptions) -> tuple[tuple[float, float], tuple[int, int]]:
    """Lower left corner [m] and cells along x and y; the first waypoint lies in the middle of its cell."""
    cell_m, margin = options.cell_m, 0 if stay_in else options.margin
    corners = np.concatenate([points, *stay_in])
    first = points[0] - cell_m / 2.0
    low = np.floor((corners.min(axis=0) - first) / cell_m + 1e-6) - margin
    high = np.ceil((corners.max(axis=0) - first) / cell_m - 1e-6) + margin
    width, height = (int(value) for value in np.maximum(high - low, 1.0))
    if width * height > MOST_CELLS:
        raise InputError(
            f'cells of {cell_m:g} m make {width} x {height} of them; pass larger ones (--cell {_larger(width, height, cell_m):g})'
        )
    lower = first + low * cell_m
    return (float(lower[0]), float(lower[1])), (width, height)


def _larger(width: int, height: int, cell_m: float) -> float:
    return float(f'{cell_m * math.sqrt(width * height / MOST_CELLS) * 1.05:.2g}')


def _waypoints(
    points: Floats, lower: tuple[float, float], size: tuple[int, int], cell_m: float, notes: list[str],
) -> tuple[int, ...]:
    at = np.minimum(np.floor((points - lower) / cell_m + 1e-6).astype(int), np.array(size) - 1)
    cells = [int(y * size[0] + x) for x, y in at]
    off_m = np.abs(points - (np.array(lower) + (at + 0.5) * cell_m)).max()
    if off_m > cell_m / 4.0:
        notes.append(f'waypoints lie up to {off_m:.1f} m from the middle of their cells, which is where the drone flies')
    kept: list[int] = []
    for number, cell in enumerate(cells, start=1):
        if kept and kept[-1] == cell:
            notes.append(f'waypoint {number} lies in the cell of the one before it and was left out (smaller cells: --cell)')
        else:
            kept.append(cell)
    if len(kept) > 1 and kept[0] == kept[-1]:
        notes.append('the first waypoint is the last one, too, where a flight begins: it stands once, at the end')
        kept = kept[1:]
    return tuple(kept)


def _blocked(
    stay_in: list[Floats], keep_out: list[Floats], lower: tuple[float, float], size: tuple[int, int], cell_m: float,
) -> tuple[int, ...]:
    """Cells that an area to keep out of touches, and those that lie not wholly in one to stay in."""
    inside, outside = ([Outline(np.vstack([ring, ring[:1]]), closed=True) for ring in rings] for rings in (stay_in, keep_out))
    blocked = []
    for cell in range(size[0] * size[1]):
        x, y = (lower[axis] + at * cell_m for axis, at in enumerate((cell % size[0], cell // size[0])))
        box = Bbox.from_extents(x + 1e-6, y + 1e-6, x + cell_m - 1e-6, y + cell_m - 1e-6)
        touched = any(one.intersects_bbox(box, filled=True) for one in outside)
        if touched or (inside and not any(_holds(one, box) for one in inside)):
            blocked.append(cell)
    return tuple(blocked)


def _holds(outline: Outline, box: Bbox) -> bool:
    return bool(outline.contains_points(box.corners()).all() and not outline.intersects_bbox(box, filled=False))
