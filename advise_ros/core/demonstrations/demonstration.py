"""Demonstrations: what a flight becomes on the grid, and PARSEDEM of algorithm 1, which counts their actions."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.grid.tables import terminal
from advise_ros.core.numerics import Floats, Ints


class EndReason(IntEnum):
    """Why a demonstration's window ended; as advise_msgs/Demonstration.end_reason."""

    FINAL_WAYPOINT = 0
    LANDED = 1
    DISARMED = 2
    STOPPED = 3
    END_OF_LOG = 4
    BLOCKED = 5


@dataclass(frozen=True)
class Audit:
    """What became of the samples; the fields are those of advise_msgs/DiscretisationAudit."""

    samples: int = 0
    late: int = 0
    unstamped: int = 0
    out_of_grid: int = 0
    cell_skips: int = 0
    ambiguous_actions: int = 0
    max_gap_s: float = 0.0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Demonstration:
    """One flight as grid states and the actions taken in them.

    Attributes:
        demonstration_id: unique in a session.
        source: where it came from.
        grid: the grid that it lies on.
        states: (n,) state indices.
        actions: (n,) action indices.
        stamps_ns: (n,) when each state was entered.
        window_ns: first and last stamp of the samples looked at, both included.

    Raises:
        InputError: lengths differ or an index is out of range.
    """

    demonstration_id: str
    source: str
    grid: Grid
    states: tuple[int, ...]
    actions: tuple[int, ...]
    stamps_ns: tuple[int, ...]
    window_ns: tuple[int, int]
    end_reason: EndReason
    audit: Audit

    def __post_init__(self) -> None:
        if not len(self.states) == len(self.actions) == len(self.stamps_ns):
            raise InputError(
                f'demonstration {self.demonstration_id}: {len(self.states)} states, {len(self.actions)} actions '
                f'and {len(self.stamps_ns)} stamps; the three must be of one length'
            )
        if any(not 0 <= s < self.grid.n_states for s in self.states):
            raise InputError(f'demonstration {self.demonstration_id}: a state is outside 0 to {self.grid.n_states - 1}')
        if any(not 0 <= a < N_ACTIONS for a in self.actions):
            raise InputError(f'demonstration {self.demonstration_id}: an action is outside 0 to {N_ACTIONS - 1}')


def standing(demonstrations: tuple[Demonstration, ...]) -> tuple[Demonstration, ...]:
    """The demonstrations that hold, in order: without those taken back.

    The recorder takes one back by publishing another with the same id and without moves. It is the last one before
    it with that id that goes: a recorder that was started again counts its flights from 1.
    """
    held: list[Demonstration] = []
    for found in demonstrations:
        if found.states:
            held.append(found)
            continue
        last = next((i for i in reversed(range(len(held))) if held[i].demonstration_id == found.demonstration_id), None)
        if last is not None:
            del held[last]
    return tuple(held)


def known(new: Demonstration, demonstrations: Iterable[Demonstration]) -> bool:
    """Whether the same demonstration, to the last stamp, was received before: its publisher came back, or it is our own."""
    return any(_sameness(new) == _sameness(old) for old in demonstrations)


def _sameness(demonstration: Demonstration) -> tuple[object, ...]:
    """The window too: two that are taken back at different times have neither moves nor stamps."""
    return (
        demonstration.demonstration_id, demonstration.states, demonstration.actions, demonstration.stamps_ns,
        demonstration.window_ns,
    )


class Counts(NamedTuple):
    """How often each action was taken in each state; the order of the demonstrations leaves no trace.

    Attributes:
        taken: (n, n_actions) int64.
    """

    taken: Ints

    @property
    def visits(self) -> Ints:
        """(n,) actions taken in each state."""
        total: Ints = self.taken.sum(axis=1)
        return total

    def distribution(self, laplace: float) -> Floats:
        """Smoothed action distributions, (n, n_actions).

        Args:
            laplace: pseudo-count added to each action.
        """
        smoothed = self.taken + laplace
        shares: Floats = smoothed / smoothed.sum(axis=1, keepdims=True)
        return shares

    def favourite(self) -> Ints:
        """(n,) a*, the most demonstrated action, ties to the lowest index; -1 without a demonstration."""
        return np.where(self.visits > 0, self.taken.argmax(axis=1), -1)


def count(grid: Grid, demonstrations: Iterable[Demonstration]) -> Counts:
    """Counts over all demonstrations; what is done after the end of a flight says nothing and is left out."""
    taken = np.zeros((grid.n_states, N_ACTIONS), dtype=np.int64)
    for demonstration in demonstrations:
        np.add.at(taken, (list(demonstration.states), list(demonstration.actions)), 1)
    taken[terminal(grid)] = 0
    return Counts(taken)


CLIMB_MISSED = (
    'the climb to the route was not heard: the vehicle may have been on its way already, '
    'and waypoints that it had reached are expected once more'
)
TAKEN_BACK = 'taken back: discarded after it was published'


def with_missed_climb(found: Demonstration) -> Demonstration:
    """The demonstration with a note in its audit that its climb was not received."""
    return replace(found, audit=replace(found.audit, notes=(CLIMB_MISSED, *found.audit.notes)))


def taken_back(demonstration_id: str, source: str, grid: Grid, now_ns: int) -> Demonstration:
    """What takes an earlier demonstration back: its id and no moves.

    Args:
        demonstration_id: of the demonstration to take back.
        source: of what takes it back.
        grid: of the demonstration.
        now_ns: stamp; its window begins and ends there.
    """
    audit = Audit(notes=(TAKEN_BACK,))
    return Demonstration(demonstration_id, source, grid, (), (), (), (now_ns, now_ns), EndReason.STOPPED, audit)
