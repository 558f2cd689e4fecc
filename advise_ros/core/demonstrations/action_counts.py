"""PARSEDEM of algorithm 1: what the demonstrations did in each state."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.planning.process import terminal


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
        """(n, n_actions) action distributions, `laplace` added to each count."""
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
