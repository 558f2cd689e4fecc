"""What would have happened otherwise: parameters of the recorded nodes, or of the grid, with other values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import yaml

from advise_ros.config import AdviseConfig, PolicyConfig, RecorderConfig, build
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.recording.gridfile import OPTIONAL, REQUIRED, grid_from_mapping, grid_to_mapping

GRID = 'grid'
CONFIGS: Mapping[str, type[Any]] = {'recorder': RecorderConfig, 'advise': AdviseConfig, 'policy': PolicyConfig}
EXAMPLE = 'write NODE.NAME:=VALUE, e.g. advise.clusters:=8 or grid.resolution:=1.0'
# As large as the map, for the same places, however fine its cells are.
MAP_KEYS = ('width', 'height', 'waypoints', 'blocked')

Overrides = Mapping[str, Mapping[str, Any]]


def parse(words: Sequence[str]) -> Overrides:
    """`advise.clusters:=8` and so on as node -> name -> value.

    Raises:
        InputError: no such node, parameter or key, or a value that is not allowed.
    """
    found: dict[str, dict[str, Any]] = {}
    for word in words:
        name, separator, text = word.partition(':=')
        node, dot, key = name.partition('.')
        if not (separator and dot and key):
            raise InputError(f'override {word!r} is malformed; {EXAMPLE}')
        if node not in (GRID, *CONFIGS):
            raise InputError(f"override {word!r}: there is no '{node}' to replay; known: {', '.join((GRID, *CONFIGS))}")
        found.setdefault(node, {})[key] = _value(word, text)
    for node, values in found.items():
        if node == GRID:
            _check_keys(values)
        else:
            build(CONFIGS[node], values)
    return found


def _value(word: str, text: str) -> Any:
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        raise InputError(f'override {word!r}: its value is not one; {EXAMPLE}') from None


def _check_keys(values: Mapping[str, Any]) -> None:
    for key in values:
        if key not in REQUIRED + OPTIONAL:
            raise InputError(f"override grid.{key}: a grid has no such key; known: {', '.join(REQUIRED + OPTIONAL)}")


def other_grid(grid: Grid, values: Mapping[str, Any]) -> Grid:
    """The grid with other values.

    Cells of another size keep the map: its width, height, waypoints and blocked cells follow, unless given.

    Raises:
        InputError: as grid_from_mapping.
    """
    if not values:
        return grid
    mapping = grid_to_mapping(grid)
    if 'resolution' in values and not set(MAP_KEYS) & set(values):
        mapping.update(_same_map(grid, float(values['resolution'])))
    return grid_from_mapping({**mapping, **values})


def _same_map(grid: Grid, resolution_m: float) -> dict[str, Any]:
    if not (math.isfinite(resolution_m) and resolution_m > 0):
        raise InputError(f'override grid.resolution is {resolution_m}; it must be a positive number')
    width, height = (max(1, round(count * grid.resolution_m / resolution_m)) for count in (grid.width, grid.height))

    def place(cell: int) -> list[int]:
        centres_m = ((index + 0.5) * grid.resolution_m for index in grid.xy(cell))
        return [min(int(at_m / resolution_m), most - 1) for at_m, most in zip(centres_m, (width, height), strict=True)]

    waypoints = [place(cell) for cell in grid.waypoints]
    kept = [at for index, at in enumerate(waypoints) if not index or at != waypoints[index - 1]]
    return {'width': width, 'height': height, 'waypoints': kept, 'blocked': [place(cell) for cell in grid.blocked]}
