"""The drone's decision process: sparse transitions and planning on them.

States are numbered by `core/grid.py`; Q is indexed [state, action].
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from advise_ros.core.grid import ACTION_STEP, N_ACTIONS, Grid
from advise_ros.core.numerics import Bools, Floats, Ints, first_best


class Mdp(NamedTuple):
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

    def outcomes(self, states: Ints, actions: Ints) -> sparse.csr_array:
        """(m, n) rows P(. | s, a) of m pairs."""
        return self.stacked[actions * self.n_states + states]

    def under(self, shares: Floats) -> sparse.csr_array:
        """(n, n) transitions when each state's actions are mixed by `shares` (n, n_actions)."""
        n, n_actions = shares.shape
        columns = np.arange(n)[:, None] + n * np.arange(n_actions)
        rows = np.arange(0, n * n_actions + 1, n_actions)
        mix = sparse.csr_array((shares.ravel(), columns.ravel(), rows), shape=(n, n * n_actions))
        mix.eliminate_zeros()
        return mix @ self.stacked


class Plan(NamedTuple):
    """The optimal value (n,) and Q (n, n_actions) of a reward."""

    value: Floats
    q: Floats


@lru_cache(maxsize=8)
def successors(grid: Grid) -> Ints:
    """`Grid.successor` of every state and action at once, (n, n_actions), read-only."""
    cells = np.arange(grid.n_cells)
    x, y = cells % grid.width, cells // grid.width
    table = np.empty((grid.n_layers, grid.n_cells, N_ACTIONS), dtype=np.int64)
    layers = np.arange(grid.n_layers)[:, None]
    ahead = np.minimum(layers + 1, grid.n_layers - 1)
    waypoints = np.array(grid.waypoints)[:, None]
    for action, (dx, dy) in enumerate(ACTION_STEP):
        inside = (x + dx >= 0) & (x + dx < grid.width) & (y + dy >= 0) & (y + dy < grid.height)
        there = np.where(inside, cells + dx + dy * grid.width, cells)
        table[:, :, action] = grid.state(np.where(there == waypoints, ahead, layers), there)  # type: ignore[arg-type]
    flat = table.reshape(grid.n_states, N_ACTIONS)
    ended = np.flatnonzero(terminal(grid))
    flat[ended] = ended[:, None]
    flat.setflags(write=False)
    return flat


def terminal(grid: Grid) -> Bools:
    """`Grid.is_terminal` of every state, (n,)."""
    ended = np.zeros((grid.n_layers, grid.n_cells), dtype=np.bool_)
    ended[:, list(grid.blocked)] = True
    ended[-1, grid.waypoints[-1]] = True
    return ended.ravel()


def occurring(grid: Grid) -> Bools:
    """States that a flight can be in and act in, (n,): not over, and not on the waypoint that is next."""
    there = ~terminal(grid).reshape(grid.n_layers, grid.n_cells)
    there[np.arange(grid.n_layers), list(grid.waypoints)] = False
    return there.ravel()


@lru_cache(maxsize=8)
def mdp_of(grid: Grid, slip: float, gamma: float) -> Mdp:
    """The grid as a decision process: a move succeeds, or with probability `slip` another one is made.

    The end of a flight (goal or blocked cell) keeps its state for ever, so its reward counts as r / (1 - gamma).
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

    Args:
        mdp: the process.
        reward: (n,) reward of each state.
        start: (n,) value to start from, e.g. the solution of a neighbouring problem; default 0.
        sweeps: backups between two improvements.

    Returns:
        The optimal value and Q, each within 1e-9 of the largest magnitude.
    """
    n = mdp.n_states
    value = np.zeros(n) if start is None else start
    limit = 1e-9 * (1.0 - mdp.gamma) * max(1.0, float(np.abs(reward).max(initial=0.0)))
    while True:
        q = reward[:, None] + mdp.gamma * (mdp.stacked @ value).reshape(mdp.n_actions, n).T
        improved = q.max(axis=1)
        if np.abs(improved - value).max() <= limit:
            return Plan(improved, q)
        chosen = mdp.outcomes(np.arange(n), q.argmax(axis=1))
        value = improved
        for _ in range(sweeps):
            value = reward + mdp.gamma * (chosen @ value)


def greedy(q: Floats) -> Ints:
    """Best action of each state (n,); ties go to the lowest index."""
    return first_best(q)


def boltzmann(q: Floats, temperature: float) -> Floats:
    """The policy of equation (3), exp(Q / temperature) normalised, (n, n_actions)."""
    scores = np.exp((q - q.max(axis=1, keepdims=True)) / temperature)
    distributions: Floats = scores / scores.sum(axis=1, keepdims=True)
    return distributions


def occupancy(mdp: Mdp, policy: Floats, start: Floats) -> Floats:
    """Discounted expected visits (n,) to each state, from a start distribution (n,) under a policy (n, n_actions)."""
    system = sparse.eye_array(mdp.n_states) - mdp.gamma * mdp.under(policy).T
    visits: Floats = splu(system.tocsc()).solve(start)
    return visits
