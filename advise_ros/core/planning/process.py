"""Decision processes: sparse transitions and planning on them, and any finite process as the learner sees it.

The drone's states are numbered by `core/grid/grid.py`; Q is indexed [state, action].
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.grid.tables import occurring, successors
from advise_ros.core.numerics import Bools, Floats, Ints, first_best

# Outcomes that differ by less, summed over the targets, are one.
ALIKE = 1e-12
# A residual of this share of the largest value is rounding: no further sweep makes it smaller.
ROUNDING = 64.0 * float(np.finfo(np.float64).eps)
# Rows of transitions may miss a sum of 1 by this much.
SUM_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Mdp:
    """A finite Markov decision process without reward.

    Attributes:
        stacked: (n_actions * n, n) the matrices P_a one under the other, so row a * n + s is P(. | s, a);
            rows sum to 1.
        gamma: discount.
    """

    stacked: sparse.csr_array
    gamma: float

    @property
    def n_states(self) -> int:
        return int(self.stacked.shape[1])

    @property
    def n_actions(self) -> int:
        return int(self.stacked.shape[0]) // self.n_states

    @cached_property
    def alike(self) -> Bools:
        """(n, n_actions, n_actions): whether two actions of a state have the same outcome."""
        same = np.ones((self.n_states, self.n_actions, self.n_actions), dtype=np.bool_)
        blocks = [self.stacked[a * self.n_states : (a + 1) * self.n_states] for a in range(self.n_actions)]
        for a, b in zip(*np.triu_indices(self.n_actions, 1), strict=True):
            same[:, a, b] = same[:, b, a] = abs(blocks[a] - blocks[b]).sum(axis=1) <= ALIKE
        return same

    def expected(self, value: Floats) -> Floats:
        """(n_actions, n) the mean of a value over the outcomes of each action in each state.

        Args:
            value: (n,).
        """
        return (self.stacked @ value).reshape(self.n_actions, self.n_states)

    def outcomes(self, states: Ints, actions: Ints) -> sparse.csr_array:
        """(m, n) rows P(. | s, a) of m pairs.

        Args:
            states, actions: (m,).
        """
        return self.stacked[actions * self.n_states + states]

    def under(self, shares: Floats) -> sparse.csr_array:
        """(n, n) transitions when each state's actions are mixed.

        Args:
            shares: (n, n_actions) probabilities of the actions.
        """
        n, n_actions = shares.shape
        columns = np.arange(n)[:, None] + n * np.arange(n_actions)
        rows = np.arange(0, n * n_actions + 1, n_actions)
        mix = sparse.csr_array((shares.flatten(), columns.ravel(), rows), shape=(n, n * n_actions))
        mix.eliminate_zeros()
        return mix @ self.stacked


class Transitions(NamedTuple):
    """Entries P(target | state, action) = probability of any process, each (k,); what is not named is 0."""

    action: Ints
    state: Ints
    target: Ints
    probability: Floats


def from_transitions(n_states: int, n_actions: int, gamma: float, transitions: Transitions) -> Mdp:
    """A process from its list of transitions; entries that name the same outcome twice add up.

    Args:
        n_states, n_actions: sizes.
        gamma: discount.
        transitions: entries; what is not named is 0.

    Raises:
        InputError: an index is out of range, a probability negative or no number, or the probabilities of an
            action in a state do not sum to 1.
    """
    for name, index, end in (
        ('action', transitions.action, n_actions), ('state', transitions.state, n_states),
        ('target', transitions.target, n_states),
    ):
        if len(index) and not 0 <= index.min() <= index.max() < end:
            raise InputError(f'transitions name {name} {index.min()} to {index.max()}; allowed is 0 to {end - 1}')
    if not (transitions.probability >= 0.0).all():
        raise InputError('transitions have a negative probability or one that is no number; give each as 0 to 1')
    rows = transitions.action * n_states + transitions.state
    entries = (transitions.probability, (rows, transitions.target))
    stacked = sparse.coo_array(entries, shape=(n_actions * n_states, n_states)).tocsr()
    sums = stacked.sum(axis=1)
    if (wrong := np.flatnonzero(abs(sums - 1.0) > SUM_TOLERANCE)).size:
        action, state = divmod(int(wrong[0]), n_states)
        raise InputError(
            f'transitions of state {state} under action {action} sum to {sums[wrong[0]]:.9g}; they must sum to 1'
        )
    stacked.data /= np.repeat(sums, np.diff(stacked.indptr))
    return Mdp(stacked, gamma)


class Plan(NamedTuple):
    """The optimal value (n,) and Q (n, n_actions) of a reward."""

    value: Floats
    q: Floats


@lru_cache(maxsize=8)
def mdp_of(grid: Grid, slip: float, gamma: float) -> Mdp:
    """The grid as a decision process: a move succeeds, or with probability `slip` another one is made.

    The end of a flight (goal or blocked cell) keeps its state for ever, so its reward counts as r / (1 - gamma).

    Args:
        grid: cells and waypoints.
        slip: probability of another move, 0 to 1.
        gamma: discount, below 1.
    """
    table = successors(grid)
    moves = [_moves(table[:, action]) for action in range(N_ACTIONS)]
    if slip > 0.0:
        any_move = sum(moves[1:], start=moves[0]) * (slip / (N_ACTIONS - 1))
        moves = [(1.0 - slip - slip / (N_ACTIONS - 1)) * move + any_move for move in moves]
    return Mdp(sparse.vstack(moves, format='csr'), gamma)


def _moves(there: Ints) -> sparse.csr_array:
    n = len(there)
    return sparse.csr_array((np.ones(n), there, np.arange(n + 1)), shape=(n, n))


def plan(mdp: Mdp, reward: Floats, start: Floats | None = None, sweeps: int = 20) -> Plan:
    """Modified policy iteration (Puterman & Shin 1978): greedy improvement, then `sweeps` backups of that policy.

    A policy that an improvement leaves as it was is most likely the optimal one, so it is evaluated by a solve.

    Args:
        mdp: the process.
        reward: (n,) reward of each state.
        start: (n,) value to start from, e.g. the solution of a neighbouring problem; default 0.
        sweeps: backups between two improvements.

    Returns:
        The optimal value and Q, each within 1e-9 of the largest magnitude, or as near as rounding allows where gamma is so
        close to 1 that this is more.
    """
    n = mdp.n_states
    value, policy, solved = np.zeros(n) if start is None else start, np.full(n, -1), False
    limit = 1e-9 * (1.0 - mdp.gamma) * max(1.0, float(np.abs(reward).max(initial=0.0)))
    while True:
        q = reward[:, None] + mdp.gamma * mdp.expected(value).T
        improved = q.max(axis=1)
        if np.abs(improved - value).max() <= max(limit, ROUNDING * float(np.abs(improved).max())):
            return Plan(improved, q)
        best = q.argmax(axis=1)
        chosen = mdp.outcomes(np.arange(n), best)
        if not solved and np.array_equal(best, policy):
            value, solved = _evaluated(chosen, reward, mdp.gamma), True
            continue
        value, policy, solved = improved, best, False
        for _ in range(sweeps):
            value = reward + mdp.gamma * (chosen @ value)


def _evaluated(chosen: sparse.csr_array, reward: Floats, gamma: float) -> Floats:
    """(n,) value of a policy, from its transitions (n, n)."""
    system = sparse.eye_array(len(reward), format='csr') - gamma * chosen
    value: Floats = splu(system.tocsc()).solve(reward)
    return value


def greedy(q: Floats) -> Ints:
    """Best action of each state (n,); ties go to the lowest index.

    Args:
        q: (n, n_actions).
    """
    return first_best(q)


def boltzmann(q: Floats, temperature: float) -> Floats:
    """The policy of equation (3), exp(Q / temperature) normalised, (n, n_actions).

    Args:
        q: (n, n_actions).
        temperature: above 0.
    """
    scores = np.exp((q - q.max(axis=1, keepdims=True)) / temperature)
    distributions: Floats = scores / scores.sum(axis=1, keepdims=True)
    return distributions


def occupancy(mdp: Mdp, policy: Floats, start: Floats) -> Floats:
    """(n,) discounted expected visits to each state.

    Args:
        mdp: the process.
        policy: (n, n_actions) probabilities.
        start: (n,) distribution of the first state.
    """
    system = sparse.eye_array(mdp.n_states) - mdp.gamma * mdp.under(policy).T
    visits: Floats = splu(system.tocsc()).solve(start)
    return visits


@dataclass(frozen=True, eq=False)
class FiniteProcess:
    """What algorithm 1 is run on: a decision process without a reward.

    Attributes:
        mdp: transitions and discount.
        acting: (m,) states in which an action is chosen, ascending; the others are never asked about.
        features: (n, f) what makes states alike beside their actions, in comparable units.
        start: (n,) distribution of the first state.
        grid: the drone's map, where the process is one; acquisition `site` needs it.
    """

    mdp: Mdp
    acting: Ints
    features: Floats
    start: Floats
    grid: Grid | None = None


@lru_cache(maxsize=8)
def process_of(grid: Grid, slip: float, gamma: float) -> FiniteProcess:
    """The drone's process: states are numbered by `core/grid/grid.py`.

    Args:
        grid: cells and waypoints.
        slip: probability that a move goes elsewhere, 0 to 1.
        gamma: discount, below 1.
    """
    start = np.zeros(grid.n_states)
    start[grid.start_state()] = 1.0
    return FiniteProcess(mdp_of(grid, slip, gamma), np.flatnonzero(occurring(grid)), grid_features(grid), start, grid)


def grid_features(grid: Grid) -> Floats:
    """(n, 2 + n_layers): east and north in units of the grid's size, and the next waypoint.

    Two states that differ in the waypoint alone are as far apart as two opposite borders.
    """
    cells = np.tile(np.arange(grid.n_cells), grid.n_layers)
    layers = np.repeat(np.arange(grid.n_layers), grid.n_cells)
    east, north = cells % grid.width / max(1, grid.width - 1), cells // grid.width / max(1, grid.height - 1)
    waypoint = np.eye(grid.n_layers)[layers] / np.sqrt(2.0)
    return np.column_stack([east, north, waypoint])
