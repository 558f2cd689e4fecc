"""The n x n system in v that one step of the interior-point method comes down to, and its factors.

With everything but v eliminated a step solves K dv = b with

    K = E' Theta E + sum over states of weights times (P_a - P_b)' (P_a - P_b),    E = I - gamma Pbar.

Where K has entries depends on the process alone, not on evidence or weights. So `Structure` is made once for a
process, and each K is two products of a sparse matrix with the weights. Its factors are of `factors.py`.
"""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt
from scipy import sparse

from advise_ros.core.irl.program import Problem
from advise_ros.core.irl.solvers.interior.factors import Factors, Pattern
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.planning.process import Mdp

# Added to the diagonal: far below what matters, enough for directions that nothing weighs.
REGULARISATION = 1e-12
# Of positions: half the memory, and room for two thousand million entries.
SHORT = np.int32
# Pairs of positions multiplied at once: the memory for it is small beside the result.
CHUNK = 1 << 16
Shorts = npt.NDArray[np.int32]


class Outer(NamedTuple):
    """Products of two entries of one row, for entries of K's upper triangle.

    Attributes:
        left, right: positions of both factors among the row entries.
        start: where the products of each entry of K begin; they lie one after the other.
        row: the row that each product comes from.
    """

    left: Shorts
    right: Shorts
    start: Shorts
    row: Shorts


class Structure(NamedTuple):
    """What K looks like for a process.

    Attributes:
        row, outcome: of each position that any action (or staying) reaches: its state, and (n_actions, k) P_a there.
        stay: (n,) the position of each state in its own row.
        own: products of the rows of E.
        edges: (nnz, n * n_edges) K's entries from the weights of pairs of actions, edge after edge.
        edge: (n_actions, n_actions) number of each pair of actions.
        pattern: of K's upper triangle.
        diagonal: (n,) positions of the diagonal.
    """

    row: Shorts
    outcome: Floats
    stay: Ints
    own: Outer
    edges: sparse.csr_array
    edge: Ints
    pattern: Pattern
    diagonal: Ints


_structures: WeakKeyDictionary[Mdp, Structure] = WeakKeyDictionary()


def structure_of(mdp: Mdp) -> Structure:
    """The structure of a process, made once."""
    if mdp not in _structures:
        _structures[mdp] = _structure(mdp)
    return _structures[mdp]


def _structure(mdp: Mdp) -> Structure:
    n, n_actions = mdp.n_states, mdp.n_actions
    reach, outcome = _aligned(mdp)
    row = np.repeat(np.arange(n, dtype=SHORT), np.diff(reach.indptr))
    left, right, start = _pairs(reach)
    columns, rows = reach.indices[right[start[:-1]]], reach.indices[left[start[:-1]]]
    own = Outer(left, right, start, row[left])
    edge = np.zeros((n_actions, n_actions), dtype=np.int64)
    first, second = np.triu_indices(n_actions, 1)
    edge[first, second] = edge[second, first] = np.arange(len(first))
    return Structure(
        row, outcome, np.flatnonzero(reach.indices == row), own, _edges(outcome, own, n), edge,
        Pattern(np.searchsorted(columns, np.arange(n + 1)).astype(SHORT), rows.astype(SHORT)),
        np.flatnonzero(rows == columns),
    )


def _aligned(mdp: Mdp) -> tuple[sparse.csr_array, Floats]:
    """All that any action or staying reaches, and each action's probabilities at those positions."""
    n, n_actions = mdp.n_states, mdp.n_actions
    reach = sparse.eye_array(n, format='csr')
    for a in range(n_actions):
        reach = reach + mdp.stacked[a * n : (a + 1) * n]
    reach.sort_indices()
    keys = np.repeat(np.arange(n), np.diff(reach.indptr)) * n + reach.indices
    outcome = np.zeros((n_actions, len(keys)))
    for a in range(n_actions):
        moves = mdp.stacked[a * n : (a + 1) * n].tocoo()
        np.add.at(outcome[a], np.searchsorted(keys, moves.row.astype(np.int64) * n + moves.col), moves.data)
    return reach, outcome


def _pairs(reach: sparse.csr_array) -> tuple[Shorts, Shorts, Shorts]:
    """All pairs left <= right of positions of the same row, by K's entries, and where those of each entry begin."""
    left, right = _pairs_within(reach.indptr)
    keys = reach.indices[right].astype(np.int64)
    keys *= reach.shape[1]
    keys += reach.indices[left]
    order = np.argsort(keys, kind='stable')
    start = np.flatnonzero(np.diff(keys[order], prepend=-1, append=-1)).astype(SHORT)
    return left[order], right[order], start


def _pairs_within(indptr: Ints) -> tuple[Shorts, Shorts]:
    lefts, rights = [], []
    lengths = np.diff(indptr)
    for length in np.unique(lengths):
        i, j = (half.astype(SHORT) for half in np.triu_indices(length))
        begin = indptr[:-1][lengths == length].astype(SHORT)[:, None]
        lefts.append((begin + i).ravel())
        rights.append((begin + j).ravel())
    return np.concatenate(lefts), np.concatenate(rights)


def _edges(outcome: Floats, own: Outer, n: int) -> sparse.csr_array:
    """(nnz, n * n_edges) K's entries from the weights of pairs of actions: few of the products are not 0."""
    first, second = np.triu_indices(len(outcome), 1)
    data, columns, counts = [], [], []
    for begin in range(0, len(own.left), CHUNK):
        these = slice(begin, begin + CHUNK)
        left, right = outcome[:, own.left[these]].T, outcome[:, own.right[these]].T
        products = (left[:, first] - left[:, second]) * (right[:, first] - right[:, second])
        pair, edge = np.nonzero(products)
        data.append(products[pair, edge])
        columns.append((edge * n + own.row[these][pair]).astype(SHORT))
        counts.append(np.count_nonzero(products, axis=1).astype(SHORT))
    before = np.concatenate([np.zeros(1, dtype=SHORT), np.cumsum(np.concatenate(counts), dtype=SHORT)])
    shape = (len(own.start) - 1, n * len(first))
    edges = sparse.csr_array((np.concatenate(data), np.concatenate(columns), before[own.start]), shape=shape)
    edges.sort_indices()
    return edges


class System:
    """K of one problem: made, factored and solved as often as wanted.

    Args:
        problem: that K is made of.
        factors: for the pattern of its process.
    """

    def __init__(self, problem: Problem, factors: Factors) -> None:
        self._structure = structure = structure_of(problem.mdp)
        rows = -problem.mdp.gamma * np.einsum('ak,ka->k', structure.outcome, problem.shares[structure.row])
        rows[structure.stay] += 1.0
        own = structure.own
        self._own = sparse.csr_array(
            (rows[own.left] * rows[own.right], own.row, own.start),
            shape=(len(structure.pattern.indices), problem.mdp.n_states),
        )
        self._factors = factors

    def factor(self, theta: Floats, edges: Floats) -> None:
        """Take new weights.

        Args:
            theta: (n,) of the rewards.
            edges: (n_edges * n,) of the pairs of actions.

        Raises:
            AdviseError: K is not positive definite in floating point.
        """
        data = self._own @ theta
        data += self._structure.edges @ edges
        data[self._structure.diagonal] += REGULARISATION
        self._factors.factor(data)

    def solve(self, right: Floats) -> Floats:
        """(n,) dv of the newest weights.

        Args:
            right: (n,) right-hand side.
        """
        return self._factors.solve(right)
