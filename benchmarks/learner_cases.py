"""Learning problems of any size for benchmarks/learner.py: routes on grids, demonstrated with mistakes, advised in part."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.advice.advice import AdviceRecord, Verdict
from advise_ros.core.advice.state import preferences
from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.grid.tables import occurring, terminal
from advise_ros.core.irl.program import Evidence, Problem, pose
from advise_ros.core.irl.settings import Terms
from advise_ros.core.numerics import Ints
from advise_ros.core.people.simulated_expert import SimulatedExpert
from advise_ros.core.planning.process import Mdp, mdp_of
from advise_ros.core.planning.rollout import optimal_table

SLIP, GAMMA = 0.1, 0.95
# Shares of states that are demonstrated, and among those demonstrated wrongly, advised, and walls where there are any.
VISITED, WRONG, ADVISED, WALLS = 0.9, 0.2, 0.1, 0.15
# An answer is about a square of states in one layer.
SQUARE = 8


class Case(NamedTuple):
    """A problem before it is posed, and one more answer.

    Attributes:
        taken: (n, n_actions) demonstrated moves.
        records: answers given, about `ADVISED` of the states.
        one_more: the next answer.
    """

    grid: Grid
    mdp: Mdp
    taken: Ints
    records: tuple[AdviceRecord, ...]
    one_more: AdviceRecord

    @property
    def favourite(self) -> Ints:
        """(n,) a*."""
        return np.where(self.taken.any(axis=1), self.taken.argmax(axis=1), -1)

    def posed(self, *, after: bool = False) -> Problem:
        """The program, with the default constants; `after` the next answer."""
        records = (*self.records, self.one_more) if after else self.records
        return pose(self.mdp, Evidence(self.favourite, preferences(records)), Terms())


def make(states: int, *, walls: bool = False, seed: int = 0) -> Case:
    """A case of about so many states: a square grid, four waypoints (one below 100 states), drawn from the seed."""
    rng = np.random.default_rng([seed, states, walls])
    layers = 4 if states >= 100 else 1
    side = round((states / layers) ** 0.5)
    grid = _grid(rng, side, layers, walls)
    right = optimal_table(grid)
    records = tuple(_answers(rng, grid, side, right))
    return Case(grid, mdp_of(grid, SLIP, GAMMA), _moves(rng, grid, np.asarray(right)), records[:-1], records[-1])


def _grid(rng: np.random.Generator, side: int, layers: int, walls: bool) -> Grid:
    """Cells without a way to the waypoints become walls too."""
    waypoints = tuple(rng.choice(side * side, layers, replace=False).tolist())
    blocked = np.flatnonzero(rng.random(side * side) < (WALLS if walls else 0.0))
    grid = Grid(1.0, side, side, (0.0, 0.0), 3.0, waypoints, tuple(np.setdiff1d(blocked, waypoints).tolist()))
    unreachable = np.flatnonzero(np.array(grid.distances_to(waypoints[-1])) < 0)
    return Grid(1.0, side, side, (0.0, 0.0), 3.0, waypoints, tuple(np.setdiff1d(unreachable, waypoints).tolist()))


def _moves(rng: np.random.Generator, grid: Grid, right: Ints) -> Ints:
    """One to five visits of most states, each by a right action or, in wrong states, mostly by one wrong action."""
    n = grid.n_states
    best = np.where(right.any(axis=1), right.argmax(axis=1), 0)
    shown = np.where(rng.random(n) < WRONG, (best + rng.integers(1, N_ACTIONS, n)) % N_ACTIONS, best)
    visits = np.where(rng.random(n) < VISITED, rng.integers(1, 6, n), 0)
    visits[terminal(grid)] = 0
    taken = np.zeros((n, N_ACTIONS), dtype=np.int64)
    taken[np.arange(n), shown] = visits
    return taken


def _answers(rng: np.random.Generator, grid: Grid, side: int, right: Ints) -> list[AdviceRecord]:
    """Answers about squares until enough states are advised, and one more; no state is in two of them."""
    expert, acting = SimulatedExpert(grid, rng), occurring(grid) & right.any(axis=1)
    answers: list[AdviceRecord] = []
    advised = 0
    for square in rng.permutation(_squares(grid, side)):
        states = np.sort(square[acting[square]])
        preferred, avoided = expert.advice(tuple(states.tolist())) if len(states) else ((), ())
        if not avoided:
            continue
        number = len(answers) + 1
        answers.append(AdviceRecord(number, number, tuple(states.tolist()), preferred, avoided, Verdict.ANSWER))
        if advised >= ADVISED * grid.n_states:
            break
        advised += len(states)
    return answers


def _squares(grid: Grid, side: int) -> Ints:
    """(k, cells) states of whole squares, that do not overlap."""
    wide = min(SQUARE, max(1, side // 4))
    edge = np.arange(side // wide) * wide
    inside = np.arange(wide)
    cells = (edge[:, None, None, None] + inside[:, None]) * side + edge[:, None, None] + inside
    cells = cells.reshape(-1, wide * wide)
    return np.concatenate([layer * grid.n_cells + cells for layer in range(grid.n_layers)])
