"""From the moves along a flight and what was commanded in it to the steps of a demonstration."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.action_rule import ActionVerdict, Commands, Decided, Stamps, decide
from advise_ros.core.demonstrations.flight_modes import Mover
from advise_ros.core.demonstrations.samples import VehicleEvent
from advise_ros.core.grid.cell_path import Follower
from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.units import NS

# A real PX4 drifts at 0.3 m/s; on small cells people fly slower, too.
DRIFT_M_S, DRIFT_CELLS_PER_S = 0.35, 0.25
SPEED_NS = NS
# A command is given on the route if a position at its altitude is not further from it than this.
NEAR_NS = NS

Floats = npt.NDArray[np.float64]


class MoveStep(NamedTuple):
    """An action, the state in which it was taken and when that was entered."""

    state: int
    action: int
    entered_ns: int


class Movers:
    """What moved the vehicle at any stamp, by its state's events in any order."""

    def __init__(self, events: tuple[VehicleEvent, ...]) -> None:
        changes = sorted((one for one in events if one.connected), key=lambda one: one.stamp_ns)
        self._stamps_ns = np.array([one.stamp_ns for one in changes], dtype=np.int64)
        self._movers = [Mover.UNKNOWN, *(one.mover for one in changes)]
        self._modes = ['', *(one.mode for one in changes)]

    def at(self, stamp_ns: int) -> Mover:
        """What moves the vehicle at a stamp; a state holds for positions with its own stamp, too.

        Args:
            stamp_ns: of a position.
        """
        return self._movers[int(np.searchsorted(self._stamps_ns, stamp_ns, side='right'))]

    def mode(self, stamp_ns: int) -> str:
        """Name of the mode, '' where it is not known.

        Args:
            stamp_ns: of a position.
        """
        return self._modes[int(np.searchsorted(self._stamps_ns, stamp_ns, side='right'))]


def decided_moves(
    follower: Follower, speeds_m_s: Floats, commands: Commands, movers: Movers, *, commanded: bool,
) -> list[Decided]:
    """The action of each move so far (see decide).

    Where neither commands nor a mode show what moves the vehicle, a flight that crosses every border slower than
    a vehicle drifts is a drift.

    Args:
        speeds_m_s: at which the border was crossed, of each move.
    """
    track = follower.track
    at_ends = [movers.at(left_ns) for left_ns in track.left_ns]
    decided = decide(commands, track, at_ends, follower.grid.resolution_m, commanded=commanded)
    drift_m_s = min(DRIFT_M_S, DRIFT_CELLS_PER_S * follower.grid.resolution_m)
    known = commanded or not all(mover in (Mover.UNKNOWN, Mover.COMMANDS) for mover in at_ends)
    if known or not len(speeds_m_s) or speeds_m_s.max() > drift_m_s:
        return decided
    return [one._replace(verdict=ActionVerdict.DRIFTED) for one in decided]


def crossing_speeds_m_s(follower: Follower, stamps_ns: Stamps, positions_enu_m: Floats) -> Floats:
    """Speed over ground in the second before the end of each move.

    Args:
        follower: with the n moves.
        stamps_ns, positions_enu_m: (k,) and (k, 3) fixes that it was given.

    Returns:
        (n,) [m/s].
    """
    left_ns = np.asarray(follower.track.left_ns, dtype=np.int64)
    if not len(left_ns):
        return np.empty(0)
    now = np.searchsorted(stamps_ns, left_ns)
    before = np.minimum(np.searchsorted(stamps_ns, left_ns - SPEED_NS), np.maximum(now - 1, 0))
    seconds = np.maximum(stamps_ns[now] - stamps_ns[before], 1) / NS
    speeds: Floats = np.hypot(*(positions_enu_m[now, :2] - positions_enu_m[before, :2]).T) / seconds
    return speeds


def has_ended(follower: Follower, decided: list[Decided]) -> bool:
    """A terminal state was entered, and not by a move that nobody made."""
    if follower.end_ns is None:
        return False
    last_ns = follower.track.left_ns[-1] if decided else -1
    return last_ns != follower.end_ns or decided[-1].verdict.is_action


def steps_of(
    follower: Follower, decided: list[Decided], commands: Commands, movers: Movers, level_ns: Stamps,
) -> list[MoveStep]:
    """The moves that somebody made, and the commands that were held towards the edge of the grid, in order.

    Args:
        level_ns: stamps of the positions at the route's altitude, on the grid or off it, ascending.
    """
    track = follower.track
    held = _held_at_edges(follower, commands, movers, level_ns)
    steps: list[MoveStep] = []
    stays = [*zip(track.states, track.entered_ns, strict=True)]
    if follower.state is not None:
        stays.append((follower.state, follower.entered_ns))
    for index, (state, entered_ns) in enumerate(stays):
        since_ns = entered_ns
        for at_ns, action in sorted(held.get(index, ())):
            steps.append(MoveStep(state, action, since_ns))
            since_ns = at_ns
        if index < len(decided) and decided[index].verdict.is_action:
            steps.append(MoveStep(state, decided[index].action, since_ns))
    return steps


def _held_at_edges(
    follower: Follower, commands: Commands, movers: Movers, level_ns: Stamps,
) -> dict[int, list[tuple[int, int]]]:
    """Index of a stay in a state -> (stamp of the last such command, action) of each direction that led off the grid.

    A direction counts as held when its commands, less those back, would have taken the vehicle a whole cell's way.
    """
    track, grid = follower.track, follower.grid
    states = [*track.states, *([follower.state] if follower.state is not None else [])]
    if not states or not len(commands) or not len(level_ns):
        return {}
    end_ns = int(level_ns[-1])
    entered = np.array([*track.entered_ns, follower.entered_ns][: len(states)], dtype=np.int64)
    left = np.maximum(np.array([*track.left_ns, end_ns][: len(states)], dtype=np.int64), entered)
    ways_m = commands.way_m(entered, left)
    found: dict[int, list[tuple[int, int]]] = {}
    for index, action in np.argwhere(ways_m >= grid.resolution_m).tolist():
        if not _stays(grid, states[index], action):
            continue
        way_m, at_ns = commands.held(action, int(entered[index]), int(left[index]))
        near = level_ns[min(int(np.searchsorted(level_ns, at_ns)), len(level_ns) - 1)]
        if abs(int(near) - at_ns) > NEAR_NS:
            continue
        if way_m >= grid.resolution_m and movers.at(at_ns) in (Mover.COMMANDS, Mover.UNKNOWN):
            found.setdefault(index, []).append((at_ns, action))
    return found


def _stays(grid: Grid, state: int, action: int) -> bool:
    """Off the grid, and so without a change of state."""
    assert 0 <= action < N_ACTIONS
    cell = grid.cell_of(state)
    return not grid.is_terminal(state) and grid.neighbour(cell, action) == cell and grid.successor(state, action) == state
