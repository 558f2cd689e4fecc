"""What stands behind the page that draws a grid file: it checks by the file's own loader, saves, and reads walls off a map.

A drawing is the mapping below `grid:` of the file. Whether it is right, only the loader says.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.grid.obstacles import OCCUPIED
from advise_ros.core.grid.raster import TOUCH, Raster, on_cells
from advise_ros.core.planning.rollout import shortest_route
from advise_ros.recording.gridfile import grid_from_mapping, grid_from_text, load_mapping, place_from_mapping
from advise_ros.recording.gridtext import are_cells, canonical, grid_text, write_new
from advise_ros.recording.picturefile import GroundPicture, corners_from_text
from advise_ros.recording.place import Place

HEAD = '# Drawn by ./advise grid draw. Metres along the axes of the grid; cells as [x, y] = [column, row], from 0.\n'
# A page with more cells than these is slow.
MOST_CELLS = 40_000
# What a drawing from nothing begins with, and about how many cells lie along the longer edge of a picture.
SIDE, CELL_M, ALTITUDE_M, ALONG = 12, 2.0, 3.0, 20
NAME = 'my_grid.yaml'
# Where the page loads the picture from.
PICTURE = '/console-picture'
# A route that is right on any grid, for what has nothing to do with the route.
ANY_ROUTE: dict[str, Any] = {'waypoints': [[0, 0]], 'blocked': []}
Reply = dict[str, Any]


class GridEditor:
    """One drawing between a page and a file.

    Args:
        path: the file that is opened, or made; None: the page names one.
        picture: what lies below.
        walls: the map that `obstacles` reads.
        folder: where files are written; None: where the path is, or where the command was started.

    Raises:
        InputError: the file is there and is none that can be drawn on.
    """

    def __init__(
        self, path: Path | None = None, picture: GroundPicture | None = None, walls: Raster | None = None,
        folder: Path | None = None,
    ) -> None:
        self.picture, self._walls = picture, walls
        self._corners = None if picture is None else picture.corners
        self._folder = (folder or (path.parent if path else Path())).resolve()
        self._name = path.name if path else NAME
        self._original, self._opened = '', {}
        if path and path.exists():
            self._opened = _drawable(path)
            self._original = path.read_bytes().decode()
        self.values = self._opened or self._new()
        if self._corners and self._corners.on_earth:
            self._corners.on_grid(place_from_mapping(self.values))

    def _new(self) -> dict[str, Any]:
        """A drawing with no waypoint: around the picture, if there is one."""
        place, corners = None, self._corners
        if corners and corners.on_earth:
            place = Place(*(round(value, 7) for value in corners.points[3]))
        points = corners.on_grid(place) if corners else [[-1.0, -1.0], [SIDE * CELL_M - 1.0] * 2]
        low, high = ([pick(point[axis] for point in points) for axis in (0, 1)] for pick in (min, max))
        longest = max(high[axis] - low[axis] for axis in (0, 1))
        cell_m = _round_number(longest / ALONG) if corners else CELL_M
        width, height = (max(1, math.floor((high[axis] - low[axis]) / cell_m + 1e-6)) for axis in (0, 1))
        on_earth = {'origin_wgs84': [place.latitude_deg, place.longitude_deg], 'heading_deg': 0.0} if place else {}
        return {
            **on_earth, 'resolution': cell_m, 'width': width, 'height': height, 'origin': [round(value, 2) for value in low],
            'altitude': ALTITUDE_M, 'waypoints': [], 'blocked': [],
        }

    def start(self) -> dict[str, Any]:
        """What a page needs first."""
        return {
            'values': self.values, 'name': self._name, 'folder': str(self._folder), 'opened': bool(self._opened),
            'most': MOST_CELLS, 'picture': PICTURE if self.picture else '', 'walls': self._walls is not None,
            **self._seen(self.values),
        }

    def act(self, name: str, given: Mapping[str, Any]) -> Reply:
        """Do what a page asks for; the reply has `ok` and a `message`.

        Args:
            name: check, save, place or obstacles.
            given: `values`, and what the act needs besides.
        """
        acts = {'check': self.check, 'save': self.save, 'place': self.place, 'obstacles': self.obstacles}
        if name not in acts or not isinstance(given.get('values'), dict):
            return {'ok': False, 'message': 'that is nothing that can be done here'}
        try:
            return acts[name](given)
        except InputError as problem:
            return {'ok': False, 'message': str(problem)}

    def check(self, given: Mapping[str, Any]) -> Reply:
        """Whether the file would load: the loader's own sentence."""
        seen = self._seen(given['values'])
        try:
            self._keep(given['values'])
            grid = self._loaded(given['values'])
        except InputError as problem:
            return {'ok': False, 'message': str(problem), **seen}
        steps = shortest_route(grid, grid.start_state())
        return {'ok': True, 'message': '', 'steps': steps, 'metres': steps * grid.resolution_m, **seen}

    def save(self, given: Mapping[str, Any]) -> Reply:
        """Write the file, if it is one that loads.

        Args:
            given: `values`, `name` of the file, and `replace` if it may take another one's place.
        """
        name, text = self._checked_name(given.get('name')), self.text(given['values'])
        self._loaded(given['values'])
        path = self._folder / name
        try:
            write_new(path, text, replace=given.get('replace') is True)
        except FileExistsError:
            if path.read_bytes() != text.encode():
                return {'ok': False, 'exists': True, 'other': self._other(name), 'message': f'{path} exists already'}
        except OSError as problem:
            raise InputError(f'{path} cannot be written ({problem.strerror}); name another file') from None
        lost = self._original and text != self._original and _has_comments(self._original)
        goes_on = f'./advise fly --grid {shlex.quote(str(path))}'
        return {'ok': True, 'message': f'{path} written', 'path': str(path), 'next': goes_on, 'lost': bool(lost)}

    def text(self, values: Mapping[str, Any]) -> str:
        """The file of a drawing; the opened one as it was, to the byte, where nothing is changed."""
        if self._opened and canonical(values) == canonical(self._opened):
            return self._original
        return grid_text(values, HEAD)

    def place(self, given: Mapping[str, Any]) -> Reply:
        """Where a picture lies that the page has.

        Args:
            given: `corners` as a person writes them, `on_earth` if they are latitudes and longitudes.
        """
        corners = corners_from_text(str(given.get('corners')), on_earth=given.get('on_earth') is True)
        found = corners.on_grid(place_from_mapping(given['values']))
        self._corners = corners
        return {'ok': True, 'message': '', 'corners': found}

    def obstacles(self, given: Mapping[str, Any]) -> Reply:
        """Block every cell that an obstacle of the map reaches into."""
        if self._walls is None:
            raise InputError('there is no map to read walls off; start with --map FILE.yaml')
        grid = grid_from_mapping({**given['values'], **ANY_ROUTE})
        obstacles = replace(self._walls, values=(self._walls.values >= OCCUPIED).astype(np.float64))
        covered, share = on_cells(obstacles, grid)
        if not covered.any():
            raise InputError('no part of the map lies on the grid; drag the area over it')
        reached = np.flatnonzero(np.nan_to_num(covered * share) > TOUCH)
        return {'ok': True, 'message': '', 'blocked': [list(grid.xy(int(cell))) for cell in reached]}

    def _loaded(self, values: Mapping[str, Any]) -> Grid:
        self._check_size(values)
        return grid_from_text(self.text(values))

    def _check_size(self, values: Mapping[str, Any]) -> None:
        width, height = (values.get(key) for key in ('width', 'height'))
        if isinstance(width, int) and isinstance(height, int) and width * height > MOST_CELLS:
            raise InputError(f'{width} x {height} cells are more than the {MOST_CELLS} that can be drawn; use larger cells')

    def _keep(self, values: dict[str, Any]) -> None:
        """A page that is loaded again goes on where it was."""
        self._check_size(values)
        try:
            grid_from_mapping({**values, **ANY_ROUTE})
        except InputError:
            return
        self.values = values

    def _seen(self, values: Mapping[str, Any]) -> Reply:
        """Where the picture lies under these values, or why it cannot be shown."""
        if self._corners is None:
            return {}
        try:
            return {'corners': self._corners.on_grid(place_from_mapping(values))}
        except InputError as problem:
            return {'corners': None, 'hidden': str(problem)}

    def _checked_name(self, name: object) -> str:
        given = str(name or '').strip()
        plain = given.isprintable() and Path(given).name == given and not given.startswith('.')
        if not plain or Path(given).suffix not in ('.yaml', '.yml'):
            raise InputError(f"the file's name is '{given}'; name one like {NAME}; it is written to {self._folder}")
        return given

    def _other(self, name: str) -> str:
        stem, ending = Path(name).stem, Path(name).suffix
        numbers = (number for number in range(2, 10_000) if not (self._folder / f'{stem}_{number}{ending}').exists())
        return f'{stem}_{next(numbers)}{ending}'


def _drawable(path: Path) -> dict[str, Any]:
    """The values of a file whose cells can be drawn; what else is wrong with it can be mended on the page."""
    values = load_mapping(path)
    try:
        grid_from_mapping({**values, **ANY_ROUTE})
        for key in ('waypoints', 'blocked'):
            if not are_cells(values.get(key) or []):
                grid_from_mapping(values)
    except InputError as problem:
        raise InputError(f'grid file {path}: {problem}') from None
    return {**values, 'blocked': values.get('blocked') or []}


def _round_number(value: float) -> float:
    """1, 2 or 5 times a power of ten, at most the value."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(f'{max(one for one in (1, 2, 5) if one * power <= value * (1 + 1e-9)) * power:.3g}')


def _has_comments(text: str) -> bool:
    return any('#' in line for line in text.removeprefix(HEAD).splitlines())
