"""One hash over what was decided from what; floats that a solver made stay out of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable

from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.grid.grid import Grid


def digest(*parts: object) -> str:
    """sha256 (hex) of the parts as JSON with sorted keys and no blanks, in UTF-8."""
    text = json.dumps(parts, sort_keys=True, separators=(',', ':'), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def evidence(demonstrations: Iterable[Demonstration], records: Iterable[AdviceRecord]) -> list[object]:
    """The demonstrations' moves and the advice, each in an order that does not depend on arrival."""
    flights = sorted([list(d.states), list(d.actions)] for d in demonstrations)
    advice = sorted([sorted(r.states), sorted(r.preferred), sorted(r.avoided)] for r in records)
    return [flights, advice]


def map_of(grid: Grid) -> list[object]:
    """What makes a grid."""
    return [
        grid.resolution_m, grid.width, grid.height, grid.origin_enu_m, grid.altitude_m, grid.waypoints, grid.blocked
    ]
