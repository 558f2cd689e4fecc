"""Where the margin rows of each state meet: the combinatorial half of the interior-point method.

The rows of one state with the weights d of a step meet in its margin like resistors in a node. Eliminating the
margin leaves a mesh: each row to ground with d_a d_0 / S, each two rows with d_a d_b / S, S the sum of all and d_0
the weight of what bounds the margin. To write that as a difference of matrices would cancel what the last steps need.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.irl.program import Pairs, Problem
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.planning.process import Mdp


class Mesh(NamedTuple):
    """What every two rows of one margin have in common.

    Attributes:
        one, other: row numbers.
        edge: (k,) pairs of actions, among all of all states, in which the rows `one[which]` and `other[which]` differ.
        which, sign: (k,).
    """

    one: Ints
    other: Ints
    edge: Ints
    which: Ints
    sign: Floats


class Margins(NamedTuple):
    """The margin rows of all demonstrated and then of all advised states; rows that are zero are left out.

    Attributes:
        mdp: the process.
        pairs: (m,) the rows.
        owner: (m,) number of each row's margin.
        start, lengths: (margins,) the first row of each, and how many there are.
        n_demonstrated, rows_demonstrated: how many margins and rows belong to demonstrated states.
        shown: rows of `Problem.demonstration_pairs` that are kept.
        caps: (n_demonstrated,).
        ground: (m,) the pair of actions of each row, among all of all states.
    """

    mdp: Mdp
    pairs: Pairs
    owner: Ints
    start: Ints
    lengths: Ints
    n_demonstrated: int
    rows_demonstrated: int
    shown: Ints
    caps: Floats
    ground: Ints
    mesh: Mesh

    def total(self, of_rows: Floats) -> Floats:
        """(margins,) sums over the rows of each margin.

        Args:
            of_rows: (m,).
        """
        return np.add.reduceat(of_rows, self.start) if len(self.start) else np.zeros(0)

    def spread(self, of_margins: Floats) -> Floats:
        """(m,) the value of each row's margin.

        Args:
            of_margins: (margins,).
        """
        return np.repeat(of_margins, self.lengths)

    def weights(self, d: Floats, d_0: Floats, total: Floats) -> Floats:
        """(n_edges * n,) weights of all pairs of actions in all states.

        Args:
            d: (m,) weights of the rows.
            d_0: (margins,) weights of what bounds each margin.
            total: (margins,) d_0 plus the rows' weights.
        """
        mesh, n, n_actions = self.mesh, self.mdp.n_states, self.mdp.n_actions
        ground = d * (d_0 / total)[self.owner]
        between = d[mesh.one] * d[mesh.other] / total[self.owner[mesh.one]]
        return np.bincount(
            np.concatenate([self.ground, mesh.edge]), np.concatenate([ground, between[mesh.which] * mesh.sign]),
            n * n_actions * (n_actions - 1) // 2,
        ).astype(np.float64, copy=False)


def margins_of(problem: Problem, edge: Ints) -> Margins:
    """The margins of a problem.

    Args:
        problem: equation (1).
        edge: (n_actions, n_actions) number of each pair of actions.
    """
    mdp, shown, advised = problem.mdp, problem.demonstration_pairs, problem.advice_pairs
    distinct = ~mdp.alike[shown.states, shown.better, shown.worse]
    kept = np.flatnonzero(distinct & (problem.terms.lambda_t > 0.0))  # Margins that nothing pays for stay out.
    shown = Pairs(*(column[kept] for column in shown))
    pairs = Pairs(*(np.concatenate(columns) for columns in zip(shown, advised, strict=True)))
    first = np.concatenate([_is_first(shown.states), _is_first(advised.states)])
    start = np.flatnonzero(first)
    n_demonstrated = int(first[: len(shown.states)].sum())
    owner = np.cumsum(first) - 1
    caps = problem.caps[np.searchsorted(problem.demonstrated, shown.states[start[:n_demonstrated]])]
    return Margins(
        mdp, pairs, owner, start, np.diff(start, append=len(owner)), n_demonstrated, len(shown.states), kept, caps,
        edge[pairs.better, pairs.worse] * mdp.n_states + pairs.states, _mesh(mdp, pairs, start, edge),
    )


def _is_first(states: Ints) -> Ints:
    return np.diff(states, prepend=-1) != 0


def _mesh(mdp: Mdp, pairs: Pairs, start: Ints, edge: Ints) -> Mesh:
    """h_one - h_other of every two rows of a margin is a sum of signed outcomes, and its square one of signed edges."""
    one, other = _two_of_each(start, len(pairs.states))
    same = pairs.better[one] == pairs.better[other]  # As in all demonstrated states: one edge, of those avoided.
    near, far = np.flatnonzero(same), np.flatnonzero(~same)
    between = edge[pairs.worse[one[near]], pairs.worse[other[near]]] * mdp.n_states + pairs.states[one[near]]
    edges, which, signs = _signed(mdp, pairs, (one, other, far), edge)
    return Mesh(
        one, other, np.concatenate([between, edges]), np.concatenate([near, which]),
        np.concatenate([np.ones(len(near)), signs]),
    )


def _signed(
    mdp: Mdp, pairs: Pairs, rows: tuple[Ints, Ints, Ints], edge: Ints,
) -> tuple[Ints, Ints, Floats]:
    """Edges, which two rows they belong to, and signs, of those twos that share no preferred action."""
    one, other, far = rows
    edges, which, signs = [], [], []
    # (a - b) - (c - d): for a vector that sums to 0, the square is the sum of -u_k u_l over its edges.
    a, b, c, d = pairs.better[one], pairs.worse[one], pairs.better[other], pairs.worse[other]
    for x, y, sign in ((a, b, 1.0), (a, c, 1.0), (a, d, -1.0), (b, c, -1.0), (b, d, 1.0), (c, d, 1.0)):
        real = far[x[far] != y[far]]
        edges.append(edge[x[real], y[real]] * mdp.n_states + pairs.states[one[real]])
        which.append(real)
        signs.append(np.full(len(real), sign))
    return _merged(np.concatenate(edges), np.concatenate(which), np.concatenate(signs))


def _merged(edge: Ints, which: Ints, sign: Floats) -> tuple[Ints, Ints, Floats]:
    """Without what cancels, as where two rows share an action."""
    _, index, back = np.unique(np.stack([which, edge]), axis=1, return_index=True, return_inverse=True)
    total = np.bincount(back, sign, len(index))
    kept = index[total != 0.0]
    return edge[kept], which[kept], total[total != 0.0]


def _two_of_each(start: Ints, n_rows: int) -> tuple[Ints, Ints]:
    """Row numbers of every two rows of each margin."""
    lengths = np.diff(start, append=n_rows)
    ones, others = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for length in np.unique(lengths):
        i, j = np.triu_indices(length, 1)
        begin = start[lengths == length][:, None]
        ones.append((begin + i).ravel())
        others.append((begin + j).ravel())
    return np.concatenate(ones), np.concatenate(others)
