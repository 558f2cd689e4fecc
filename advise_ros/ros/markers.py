"""RViz markers: the question's cells lit, the policy's arrows of its layers, the waypoints numbered; the drone's track.

With acquisition `site` also the cells in dispute, and the route after either answer: whole where it keeps out of them,
dashed where it may fly through.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING

from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from advise_ros.core.advice.advice import AnswerOption, Meaning, Query
from advise_ros.core.grid.grid import ACTION_STEP, Grid
from advise_ros.core.units import MAP_FRAME
from advise_ros.ros.convert import stamp_from_ns

if TYPE_CHECKING:  # The recorder draws the track, and needs no learner.
    from advise_ros.core.learning.learner import Learned

# One colour a layer (the next waypoint), repeated when there are more; a palette that colour-blind people can distinguish.
LAYER_COLOURS = ((0.90, 0.62, 0.0), (0.34, 0.71, 0.91), (0.0, 0.62, 0.45), (0.80, 0.47, 0.65), (0.94, 0.89, 0.26))
WHITE = (1.0, 1.0, 1.0)
GREY = (0.35, 0.35, 0.35)
TRACK_COLOUR = (0.84, 0.37, 0.0)
DISPUTED_COLOUR = (0.84, 0.37, 0.0)
ROUTE_COLOUR = (0.0, 0.8, 0.55)
# Layers are drawn above each other, this share of a cell apart.
LAYER_GAP = 0.08
TRACK_WIDTH_M = 0.08
ROUTE_WIDTH_CELLS = 0.08


def question_markers(learned: Learned, query: Query | None, stamp_ns: int) -> MarkerArray:
    """Every marker anew, behind one that deletes what was there."""
    grid = learned.grid
    layers = sorted({grid.next_waypoint(state) for state in query.states}) if query else list(range(grid.n_layers))
    markers = [Marker(action=Marker.DELETEALL)]
    markers += [_lit(grid, layer, query.states) for layer in layers] if query else []
    markers += [_disputed(grid, layers[0], query.disputed)] if query and query.disputed else []
    markers += [_route(grid, layers[0], option) for option in query.options] if query else []
    markers += [_arrows(learned, layer) for layer in layers]
    markers += [_blocked(grid)] if grid.blocked else []
    for index in range(grid.n_layers):
        markers += [_waypoint(grid, index), _number(grid, index)]
    for marker in markers:
        marker.header.frame_id, marker.header.stamp = MAP_FRAME, stamp_from_ns(stamp_ns)
    return MarkerArray(markers=markers)


def track_marker(points: list[Point], stamp_ns: int) -> Marker:
    """Where the drone was, as a line in frame map."""
    out = _marker('track', 0, Marker.LINE_STRIP, _colour(TRACK_COLOUR, 0.9))
    out.header.frame_id, out.header.stamp = MAP_FRAME, stamp_from_ns(stamp_ns)
    out.scale.x, out.points = TRACK_WIDTH_M, points
    return out


def _marker(namespace: str, index: int, kind: int, colour: ColorRGBA) -> Marker:
    out = Marker(ns=namespace, id=index, type=kind, action=Marker.ADD, color=colour)
    out.pose.orientation.w = 1.0
    return out


def _lit(grid: Grid, layer: int, states: Iterable[int]) -> Marker:
    """The question's cells of one layer as flat tiles."""
    out = _marker('question', layer, Marker.CUBE_LIST, _layer_colour(layer, 0.55))
    out.scale.x = out.scale.y = 0.9 * grid.resolution_m
    out.scale.z = 0.02 * grid.resolution_m
    out.points = [_centre(grid, grid.cell_of(s), layer) for s in states if grid.next_waypoint(s) == layer]
    return out


def _disputed(grid: Grid, layer: int, cells: Iterable[int]) -> Marker:
    """Cells that the answer decides to keep out of, as low blocks."""
    out = _marker('disputed', layer, Marker.CUBE_LIST, _colour(DISPUTED_COLOUR, 0.6))
    out.scale.x = out.scale.y = 0.6 * grid.resolution_m
    out.scale.z = 0.15 * grid.resolution_m
    out.points = [_centre(grid, cell, layer) for cell in cells]
    return out


def _route(grid: Grid, layer: int, option: AnswerOption) -> Marker:
    """The route in one layer that is expected after an answer: a line, or dashes that end half-way to the next cell."""
    keeps_out = option.meaning is Meaning.KEEP_OUT
    name = f'route_{option.meaning.name.lower()}'
    out = _marker(name, layer, Marker.LINE_STRIP if keeps_out else Marker.LINE_LIST, _colour(ROUTE_COLOUR, 0.95))
    out.scale.x = ROUTE_WIDTH_CELLS * grid.resolution_m
    cells = [grid.cell_of(state) for state in option.route if grid.next_waypoint(state) == layer]
    points = [_centre(grid, cell, layer) for cell in [*cells, grid.waypoints[layer]]] if cells else []
    for point in points:
        point.z += 0.06 * grid.resolution_m
    out.points = points if keeps_out else [end for a, b in pairwise(points) for end in (a, _half_way(a, b))]
    return out


def _half_way(a: Point, b: Point) -> Point:
    return Point(x=(a.x + b.x) / 2, y=(a.y + b.y) / 2, z=(a.z + b.z) / 2)


def _arrows(learned: Learned, layer: int) -> Marker:
    """The greedy action of each cell of one layer: triangles that point where it leads."""
    grid = learned.grid
    out = _marker('policy', layer, Marker.TRIANGLE_LIST, _layer_colour(layer, 1.0))
    out.scale.x = out.scale.y = out.scale.z = 1.0
    for cell in range(grid.n_cells):
        state = grid.state(layer, cell)
        if not grid.is_terminal(state):
            out.points.extend(_arrow(grid, cell, layer, int(learned.greedy[state])))
    return out


def _arrow(grid: Grid, cell: int, layer: int, action: int) -> list[Point]:
    centre = _centre(grid, cell, layer)
    dx, dy = (0.35 * grid.resolution_m * step for step in ACTION_STEP[action])
    z = centre.z + 0.03 * grid.resolution_m
    tip = Point(x=centre.x + dx, y=centre.y + dy, z=z)
    left = Point(x=centre.x - dx / 2 - dy / 2, y=centre.y - dy / 2 + dx / 2, z=z)
    right = Point(x=centre.x - dx / 2 + dy / 2, y=centre.y - dy / 2 - dx / 2, z=z)
    return [tip, left, right]


def _blocked(grid: Grid) -> Marker:
    out = _marker('blocked', 0, Marker.CUBE_LIST, _colour(GREY, 0.9))
    out.scale.x = out.scale.y = grid.resolution_m
    out.scale.z = 0.5 * grid.resolution_m
    out.points = [_centre(grid, cell, 0) for cell in grid.blocked]
    return out


def _waypoint(grid: Grid, index: int) -> Marker:
    out = _marker('waypoints', index, Marker.SPHERE, _layer_colour(index, 0.9))
    out.pose.position = _centre(grid, grid.waypoints[index], index)
    out.scale.x = out.scale.y = out.scale.z = 0.3 * grid.resolution_m
    return out


def _number(grid: Grid, index: int) -> Marker:
    """The waypoint's number, counted from 1 as people do; the last one is the final position."""
    out = _marker('waypoint_numbers', index, Marker.TEXT_VIEW_FACING, _colour(WHITE, 1.0))
    out.pose.position = _centre(grid, grid.waypoints[index], index)
    out.pose.position.z += 0.5 * grid.resolution_m
    out.scale.z = 0.4 * grid.resolution_m
    out.text = f'{index + 1} (final)' if index == grid.n_layers - 1 else str(index + 1)
    return out


def _centre(grid: Grid, cell: int, layer: int) -> Point:
    x, y = grid.centre_enu_m(cell)
    return Point(x=x, y=y, z=grid.altitude_m + LAYER_GAP * layer * grid.resolution_m)


def _layer_colour(layer: int, alpha: float) -> ColorRGBA:
    return _colour(LAYER_COLOURS[layer % len(LAYER_COLOURS)], alpha)


def _colour(rgb: tuple[float, float, float], alpha: float) -> ColorRGBA:
    return ColorRGBA(r=rgb[0], g=rgb[1], b=rgb[2], a=alpha)
