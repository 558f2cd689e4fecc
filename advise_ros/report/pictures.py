"""Pictures of a session: the site with what was flown and learnt, policies one map a waypoint, questions, success."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from advise_ros.core.advice.advice import Query
from advise_ros.core.demonstrations.demonstration import Demonstration, count
from advise_ros.core.grid.grid import ACTION_STEP, Grid

FloatArray = npt.NDArray[np.float64]

# Okabe and Ito's colours, told apart by colour-blind readers.
ORANGE, GREEN, BLUE, VERMILION, PURPLE = '#E69F00', '#009E73', '#0072B2', '#D55E00', '#CC79A7'
LIT = '#FDE7B5'
PANEL_IN = 2.1
ARROW_CELLS = 0.44
SHORTEST_ARROW_CELLS = 0.03
# Probability of keep-out from which on a cell is coloured.
SHOWN_FROM = 0.05
ROUTE_STYLES = ('-', '--')


@dataclass(frozen=True)
class FlownTrack:
    """One flown track.

    Attributes:
        kind: of TRACKS.
        positions_enu_m: (n, 2) east and north.
        reached: the final waypoint was reached in order.
    """

    kind: str
    positions_enu_m: FloatArray
    reached: bool


def to_svg(figure: Figure) -> str:
    """The figure as an SVG element; the same figure gives the same bytes."""
    buffer = io.StringIO()
    with mpl.rc_context({'svg.hashsalt': 'advise_ros', 'svg.fonttype': 'none'}):
        figure.savefig(buffer, format='svg', bbox_inches='tight', metadata={'Date': None})
    text = buffer.getvalue()
    return text[text.index('<svg'):]


def draw_map(axes: Axes, grid: Grid, layer: int | None = None) -> None:
    """Cells, blocked cells and numbered waypoints; `layer` rings the waypoint that is next."""
    axes.set_xlim(-0.05, grid.width + 0.05)
    axes.set_ylim(-0.05, grid.height + 0.05)
    axes.set_aspect('equal')
    axes.set_axis_off()
    for index in range(grid.width + 1):
        axes.plot([index, index], [0, grid.height], color='#cccccc', linewidth=0.6, zorder=1)
    for index in range(grid.height + 1):
        axes.plot([0, grid.width], [index, index], color='#cccccc', linewidth=0.6, zorder=1)
    for cell in grid.blocked:
        axes.add_patch(Rectangle(grid.xy(cell), 1, 1, facecolor='#444444', zorder=2))
    for number, cell in enumerate(grid.waypoints, start=1):
        x, y = grid.xy(cell)
        ahead = layer is not None and number == layer + 1
        ink, paper = ('white', 'black') if ahead else ('black', 'white')
        disc = {'boxstyle': 'circle,pad=0.18', 'facecolor': paper, 'edgecolor': 'black', 'linewidth': 0.8}
        axes.text(x + 0.14, y + 0.72, str(number), fontsize=8, fontweight='bold', zorder=6, color=ink, bbox=disc)


def draw_cells(axes: Axes, grid: Grid, layer: int, colour: Callable[[int], str | None]) -> None:
    """Fill each cell of a layer with `colour(state)`."""
    for cell in range(grid.n_cells):
        fill = colour(grid.state(layer, cell))
        if fill is not None and not grid.is_blocked(cell):
            axes.add_patch(Rectangle(grid.xy(cell), 1, 1, facecolor=fill, edgecolor='none', zorder=0))


def draw_arrows(axes: Axes, grid: Grid, layer: int, strength: FloatArray, colour: str) -> None:
    """An arrow per cell and action, as long as `strength` (n_states, n_actions) in 0..1 says."""
    tails, vectors = [], []
    for cell in range(grid.n_cells):
        state = grid.state(layer, cell)
        if grid.is_terminal(state):
            continue
        x, y = grid.xy(cell)
        for action, (dx, dy) in enumerate(ACTION_STEP):
            length = ARROW_CELLS * float(strength[state, action])
            if length > SHORTEST_ARROW_CELLS:
                tails.append((x + 0.5, y + 0.5))
                vectors.append((dx * length, dy * length))
    if tails:
        axes.quiver(
            *np.transpose(tails), *np.transpose(vectors), color=colour, angles='xy', scale_units='xy', scale=1,
            width=0.05, units='xy', headwidth=3.2, headlength=3.2, headaxislength=3.0, minlength=0, zorder=4,
        )


def one_hot(greedy: npt.NDArray[np.uint8], n_actions: int) -> FloatArray:
    """(n_states, n_actions) with 1 at each state's action."""
    return np.eye(n_actions)[greedy]


def layers_figure(
    grid: Grid, rows: Sequence[tuple[str, Callable[[int], str | None], FloatArray | None, str]],
) -> Figure:
    """A row of maps, one a waypoint, for each (title, colour of a state, arrow strengths, arrow colour)."""
    figure = Figure(figsize=(PANEL_IN * grid.n_layers, (PANEL_IN + 0.35) * len(rows)), layout='constrained')
    axes = figure.subplots(len(rows), grid.n_layers, squeeze=False)
    for row, (title, colour, strength, arrow_colour) in enumerate(rows):
        for layer in range(grid.n_layers):
            panel = axes[row][layer]
            draw_map(panel, grid, layer)
            draw_cells(panel, grid, layer, colour)
            if strength is not None:
                draw_arrows(panel, grid, layer, strength, arrow_colour)
            panel.set_title(f'{title}\nto waypoint {layer + 1}' if layer == 0 else f'to waypoint {layer + 1}', fontsize=9)
    return figure


def keep_out_colour(keep_out: FloatArray) -> Callable[[int], str | None]:
    """Colour of a state by the probability (cells,) that its cell is to be kept out of; cells as good as free stay white."""
    def colour(state: int) -> str | None:
        share = float(keep_out[state % len(keep_out)])
        return str(mpl.colors.to_hex(mpl.colormaps['Reds'](0.75 * share))) if share >= SHOWN_FROM else None

    return colour


def draw_hidden(axes: Axes, grid: Grid, cells: Sequence[int], name: str = '') -> None:
    """Hatch cells that no map shows; the first one bears a name."""
    for cell in cells:
        axes.add_patch(Rectangle(grid.xy(cell), 1, 1, fill=False, hatch='////', edgecolor='#7a8b70', linewidth=0, zorder=2))
        for action, (dx, dy) in enumerate(ACTION_STEP):
            if grid.neighbour(cell, action) not in cells:
                (x, y), along = grid.xy(cell), (abs(dy), abs(dx))
                corner = (x + (dx > 0), y + (dy > 0))
                ends = zip(corner, (corner[0] + along[0], corner[1] + along[1]), strict=True)
                axes.plot(*ends, color='#4c5f41', linewidth=1.6, zorder=3)
    if name and cells:
        xs, ys = zip(*map(grid.xy, cells), strict=True)
        paper = {'boxstyle': 'round,pad=0.15', 'facecolor': 'white', 'edgecolor': 'none', 'alpha': 0.85}
        axes.text(np.mean(xs) + 0.5, np.mean(ys) + 0.5, name, fontsize=9, ha='center', va='center', zorder=8, bbox=paper)


def draw_way(axes: Axes, grid: Grid, states: Sequence[int], **style: object) -> None:
    """A computed way over cell centres, states of a flight from its start."""
    x, y = np.array([grid.xy(grid.cell_of(state)) for state in states]).T + 0.5
    axes.plot(x, y, **style)


def draw_track(axes: Axes, grid: Grid, track: FlownTrack, **style: object) -> None:
    """A flown track, with a cross where it gave up."""
    x, y = ((track.positions_enu_m - np.array(grid.origin_enu_m)) / grid.resolution_m).T
    axes.plot(x, y, **style)
    if not track.reached and len(x):
        axes.plot(x[-1], y[-1], marker='x', color='black', markersize=8, zorder=9)


@dataclass(frozen=True)
class SitePanel:
    """One map of a site.

    Attributes:
        hidden: cells that the person wants kept out of; no map shows them.
        planned: states of the planner's way.
        keep_out: (cells,) learnt probability, None where nothing is learnt yet.
    """

    title: str
    grid: Grid
    hidden: Sequence[int]
    planned: Sequence[int]
    tracks: Sequence[FlownTrack]
    keep_out: FloatArray | None = None


# Colour, width and line of what is flown, and its name in the legend.
TRACKS = {
    'demonstration': (BLUE, 0.8, '-', 'flown by the pilot'), 'before': (PURPLE, 2.0, '--', 'flown without advice'),
    'after': (GREEN, 2.2, '-', 'flown with advice'), 'other': (GREEN, 2.2, '-', 'flown'),
}


def site_figure(panels: Sequence[SitePanel]) -> Figure:
    """Maps of a site side by side: what is hidden, what is believed, what a planner would fly and what was flown."""
    figure = Figure(figsize=(4.1 * len(panels), 4.9), layout='constrained')
    for axes, panel in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
        draw_map(axes, panel.grid)
        if panel.keep_out is not None:
            draw_cells(axes, panel.grid, 0, keep_out_colour(panel.keep_out))
        draw_hidden(axes, panel.grid, panel.hidden, 'garden')
        draw_way(axes, panel.grid, panel.planned, color='black', linewidth=2.0, linestyle=':', zorder=5, label="planner's route")
        named = set()
        for track in panel.tracks:
            colour, width, line, name = TRACKS[track.kind]
            label = name if name not in named else None
            draw_track(axes, panel.grid, track, color=colour, linewidth=width, linestyle=line, alpha=0.8, zorder=4, label=label)
            named.add(name)
        axes.set_title(panel.title, fontsize=11)
        axes.legend(loc='upper center', bbox_to_anchor=(0.5, 0.0), ncols=3, fontsize=8, frameon=False, handlelength=1.8)
    return figure


def question_figure(
    grid: Grid, query: Query, greedy: npt.NDArray[np.uint8], demonstrations: Sequence[Demonstration],
) -> Figure:
    """What a person is shown of a question: its cells lit, what was flown, and what the policy of that time would do.

    Where it decides about a site: the cells in dispute, and the routes after either answer (dashed: it may fly through).
    """
    states = query.states
    layers = sorted({grid.next_waypoint(state) for state in states})
    taken = count(grid, demonstrations).taken
    flown = taken / np.maximum(taken.sum(axis=1, keepdims=True), 1)
    figure = Figure(figsize=((PANEL_IN + 0.4) * len(layers), PANEL_IN + 0.9), layout='constrained')
    for axes, layer in zip(figure.subplots(1, len(layers), squeeze=False)[0], layers, strict=True):
        draw_map(axes, grid, layer)
        draw_cells(axes, grid, layer, lambda state: LIT if state in states else None)
        draw_arrows(axes, grid, layer, flown, BLUE)
        draw_arrows(axes, grid, layer, 0.45 * one_hot(greedy, flown.shape[1]), 'black')
        for cell in query.disputed:
            axes.add_patch(Rectangle(grid.xy(cell), 1, 1, fill=False, hatch='///', edgecolor=VERMILION, linewidth=1.2, zorder=3))
        for option, style in zip(query.options, ROUTE_STYLES, strict=False):
            draw_route(axes, grid, layer, option.route, style)
        axes.set_title(f'to waypoint {layer + 1}: {_shown(query)},\nblue was flown, black would be flown', fontsize=7)
    return figure


def _shown(query: Query) -> str:
    if not query.options:
        return 'lit is asked about'
    keep, through = (option.label.split(':')[0] for option in query.options)
    return f'hatched is in dispute;\npurple: after "{keep}", dashed: after "{through}"'


def draw_route(axes: Axes, grid: Grid, layer: int, route: Sequence[int], style: str) -> None:
    """The part of a route of states that lies in one layer, up to its waypoint."""
    cells = [grid.cell_of(state) for state in route if grid.next_waypoint(state) == layer]
    if cells:
        columns, rows = np.transpose([grid.xy(cell) for cell in [*cells, grid.waypoints[layer]]])
        axes.plot(columns + 0.5, rows + 0.5, color='#5b2fb0', linestyle=style, linewidth=2.2, alpha=0.8, zorder=5)


def success_figure(rows: Sequence[tuple[str, float, float, float]]) -> Figure:
    """Bars of success [%] with their 95 % interval: (label, mean, low, high)."""
    figure = Figure(figsize=(6.4, 0.7 + 0.5 * len(rows)), layout='constrained')
    axes = figure.subplots()
    for index, (_, mean, low, high) in enumerate(rows):
        axes.barh(index, mean, color=VERMILION if index == 0 else GREEN, height=0.6)
        axes.errorbar(mean, index, xerr=[[mean - low], [high - mean]], color='black', capsize=3, linewidth=1)
    axes.set_xlim(0, 101)
    axes.set_yticks(range(len(rows)), [f'{label}: {mean:.0f} %' for label, mean, _, _ in rows], fontsize=9)
    axes.invert_yaxis()
    axes.set_xlabel('all waypoints in order, and nothing entered that is to be kept out of [%]', fontsize=9)
    axes.tick_params(axis='y', length=0)
    axes.spines[['top', 'right', 'left']].set_visible(False)
    return figure
