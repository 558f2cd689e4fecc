"""The grid file: YAML with one mapping `grid`, metres in ENU, cells as [x, y], and the grid's place on the earth."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import yaml

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.grid.obstacles import with_obstacles
from advise_ros.recording.mapfile import read_map
from advise_ros.recording.place import Place
from advise_ros.yaml_problem import in_words

REQUIRED = ('resolution', 'width', 'height', 'origin', 'altitude', 'waypoints')
OPTIONAL = ('blocked', 'origin_wgs84', 'heading_deg')
# Keys that hold cells, and what one of these is called.
CELLS = {'waypoints': 'waypoint', 'blocked': 'blocked cell', 'keep_out': 'cell to keep out of'}
ValueT = TypeVar('ValueT')
EXAMPLE = 'see config/grid_6x6.yaml for one that works'


def load_grid(path: str | Path, obstacle_map_file: str | Path = '') -> Grid:
    """Read a grid file.

    The resolution is rounded to 7 significant digits, as it travels in messages as a float32.

    Args:
        path: the grid file.
        obstacle_map_file: YAML file of a map whose obstacles are blocked cells, too; empty: none.

    Raises:
        InputError: no file named, a file is missing or no YAML, a key is missing, unknown or of the
            wrong type, a cell lies outside, or a waypoint is in an obstacle; one sentence with file, key, value and remedy.
    """
    grid = _grid_of(path)
    if not str(obstacle_map_file):
        return grid
    occupancy = read_map(obstacle_map_file)
    try:
        return with_obstacles(grid, occupancy)
    except InputError as problem:
        raise InputError(f'map file {obstacle_map_file}: {problem}') from problem


def load_place(path: str | Path) -> Place | None:
    """Where a grid file says that its metres begin on the earth, None where it does not.

    Raises:
        InputError: as load_grid.
    """
    return _of_file(path, place_from_mapping)


def load_mapping(path: str | Path) -> dict[str, Any]:
    """The keys below `grid:` as they stand in a grid file; nothing of them is checked.

    Raises:
        InputError: as load_grid, of what is no grid file at all.
    """
    return _of_file(path, dict)


def grid_from_text(text: str) -> Grid:
    """The grid of a grid file's text.

    Raises:
        InputError: as load_grid, without the file's name.
    """
    return grid_from_mapping(_grid_mapping(_parsed(text, f'a grid, {EXAMPLE}')))


def _grid_of(path: str | Path) -> Grid:
    return _of_file(path, grid_from_mapping)


def _of_file(path: str | Path, made: Callable[[Mapping[str, Any]], ValueT]) -> ValueT:
    if not str(path):
        raise InputError(f"no grid file is given; set parameter 'grid_file' (or --grid) to a YAML file, {EXAMPLE}")
    try:
        return made(_grid_mapping(read_yaml(Path(path), f'a grid, {EXAMPLE}')))
    except InputError as problem:
        raise InputError(f'grid file {path}: {problem}') from problem


def grid_from_mapping(values: Mapping[str, Any]) -> Grid:
    """The grid of the keys below `grid:`.

    Raises:
        InputError: as load_grid, without the file's name.
    """
    _check_keys(values)
    place_from_mapping(values)
    width, height = (_count(name, values[name]) for name in ('width', 'height'))
    return Grid(
        resolution_m=float(f'{_number("resolution", values["resolution"]):.7g}'),
        width=width,
        height=height,
        origin_enu_m=_origin(values['origin']),
        altitude_m=_number('altitude', values['altitude']),
        waypoints=cells_of('waypoints', values['waypoints'], width, height),
        blocked=cells_of('blocked', values.get('blocked') or [], width, height),
    )


def place_from_mapping(values: Mapping[str, Any]) -> Place | None:
    """The place that the keys below `grid:` name: origin_wgs84, and heading_deg of the y axis (0: north).

    Raises:
        InputError: as load_grid, without the file's name.
    """
    at, heading = values.get('origin_wgs84'), values.get('heading_deg')
    if at is None and heading is None:
        return None
    if not isinstance(at, list) or len(at) != 2:
        raise InputError(f"key 'origin_wgs84' is {at!r}; it must be [latitude, longitude] in degrees")
    latitude, longitude = (_number('origin_wgs84', value) for value in at)
    if not (-90 <= latitude <= 90 and -180 <= longitude <= 180):
        raise InputError(f"key 'origin_wgs84' is {at!r}; it must be [latitude, longitude] in degrees, within 90 and 180")
    return Place(latitude, longitude, _number('heading_deg', 0.0 if heading is None else heading))


def grid_to_mapping(grid: Grid) -> dict[str, Any]:
    """The keys below `grid:` that load as this grid."""
    return {
        'resolution': grid.resolution_m,
        'width': grid.width,
        'height': grid.height,
        'origin': list(grid.origin_enu_m),
        'altitude': grid.altitude_m,
        'waypoints': [list(grid.xy(cell)) for cell in grid.waypoints],
        'blocked': [list(grid.xy(cell)) for cell in grid.blocked],
    }


def read_yaml(path: Path, wanted: str) -> Any:
    """The document of a YAML file that is to hold what is wanted.

    Raises:
        InputError: it cannot be read or is no YAML; without the file's name.
    """
    try:
        return _parsed(path.read_text(encoding='utf-8'), wanted)
    except FileNotFoundError:
        raise InputError(f'there is no such file; name a YAML file with {wanted}') from None
    except OSError as problem:
        raise InputError(f'it cannot be read ({problem.strerror}); name a YAML file with {wanted}') from None
    except UnicodeDecodeError as problem:
        raise InputError(f'{in_words(problem)}; name a YAML file with {wanted}') from None


def _parsed(text: str, wanted: str) -> Any:
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as problem:
        raise InputError(f'{in_words(problem)}; name a YAML file with {wanted}') from None


def _grid_mapping(document: Any) -> Mapping[str, Any]:
    if not isinstance(document, dict) or not isinstance(document.get('grid'), dict):
        raise InputError(f"it has no mapping 'grid'; {EXAMPLE}")
    for key in document:
        if key != 'grid':
            raise InputError(f"key '{key}' is unknown beside 'grid'; drop it")
    return {str(key): value for key, value in document['grid'].items()}


def _check_keys(values: Mapping[str, Any]) -> None:
    known = REQUIRED + OPTIONAL
    for key in values:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f'known: {", ".join(known)}'
            raise InputError(f"key '{key}' is unknown; {hint}")
    for key in REQUIRED:
        if key not in values:
            raise InputError(f"key '{key}' is missing; {EXAMPLE}")


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"key '{name}' is {value!r}; it must be a number")
    return float(value)


def _count(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value <= 0:
        raise InputError(f"key '{name}' is {value!r}; it must be a positive whole number of cells")
    return value


def _origin(value: Any) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise InputError(f"key 'origin' is {value!r}; it must be [x, y] in metres")
    return _number('origin', value[0]), _number('origin', value[1])


def cells_of(name: str, value: Any, width: int, height: int) -> tuple[int, ...]:
    """Indices of the cells [x, y] that stand below a key of CELLS.

    Raises:
        InputError: it is no list of cells on a grid of this width and height.
    """
    if not isinstance(value, list):
        raise InputError(f"key '{name}' is {value!r}; it must be a list of cells [x, y]")
    return tuple(_cell(name, cell, width, height) for cell in value)


def _cell(name: str, value: Any, width: int, height: int) -> int:
    whole = isinstance(value, list) and len(value) == 2 and all(type(v) is int for v in value)
    if not whole:
        raise InputError(f"key '{name}' holds {value!r}; a cell is two whole numbers [x, y]")
    x, y = value
    if not (0 <= x < width and 0 <= y < height):
        raise InputError(
            f'{CELLS[name]} [{x}, {y}] lies outside the {width} x {height} grid; '
            f'x goes from 0 to {width - 1}, y from 0 to {height - 1}'
        )
    return int(y * width + x)
