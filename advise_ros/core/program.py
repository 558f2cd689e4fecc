"""Equation (1) of Odom & Natarajan (AAMAS 2016) as one sparse linear program.

The paper writes v = (I - gamma P_a*)^-1 r into every row, which makes them dense. Here v and r are variables:

    maximise   -sum_i |r_i| + lambda_t sum_{i in D} xi_i + lambda_a sum_{j in S} zeta_j - M sum_{j in S} eta_j
    subject to v = r + gamma Pbar v,   |r_i| <= r_max
               (P_a* - P_a)_i v  >= xi_i                     i in D, a != a*_i,           xi_i <= cap
               (P_a - P_a')_j v  >= zeta_j + delta - eta_j   j in S, (a, a') advised,     0 <= zeta_j <= cap, eta_j >= 0

D are the demonstrated states and S the advised ones. Where the paper is ambiguous `Terms` names the choice:

- reading 'replace' (default): advice takes the place of a*; the state leaves D and its row of Pbar is the
  uniform mix of the preferred actions. 'literal': the state stays in D and Pbar keeps the demonstrated action.
- margin_cap bounds xi and zeta (0: unbounded, as printed).
- slack_cost M makes advice elastic, so that contradictory answers cost instead of making the program
  infeasible (0: strict, as printed).

States without demonstration or advice have the uniform mix of all actions in Pbar. Two actions with the same
outcome cannot be told apart, so an advised pair of them makes no row.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy import sparse

from advise_ros.core.mdp import Mdp
from advise_ros.core.numerics import Floats, Ints


class Terms(NamedTuple):
    """The constants of the program and its readings."""

    reading: str = 'replace'
    lambda_t: float = 1000.0
    lambda_a: float = 500.0
    r_max: float = 1.0
    delta: float = 0.1
    margin_cap: float = 0.2
    slack_cost: float = 1000.0


class Preference(NamedTuple):
    """What the advice says about one state, all answers together.

    Attributes:
        preferred: ascending actions.
        pairs: ascending (preferred, avoided) actions.
    """

    preferred: tuple[int, ...]
    pairs: tuple[tuple[int, int], ...]


class Evidence(NamedTuple):
    """What the program learns from.

    Attributes:
        favourite: (n,) the most demonstrated action a*, -1 without a demonstration.
        advice: preference of each advised state.
    """

    favourite: Ints
    advice: Mapping[int, Preference]


class Pairs(NamedTuple):
    """Margin rows: in `states`, `better` is to be worth more than `worse`; each (m,)."""

    states: Ints
    better: Ints
    worse: Ints

    def differences(self, mdp: Mdp) -> sparse.csr_array:
        """(m, n) rows P_better - P_worse."""
        return mdp.outcomes(self.states, self.better) - mdp.outcomes(self.states, self.worse)


class Problem(NamedTuple):
    """The program before it is written as a matrix: what both solvers read.

    Attributes:
        mixed: (n, n) Pbar.
        demonstrated: D ascending.
        advised: S ascending, the advised states that have a row.
        demonstration_pairs, advice_pairs: the margin rows.
    """

    mdp: Mdp
    terms: Terms
    mixed: sparse.csr_array
    demonstrated: Ints
    advised: Ints
    demonstration_pairs: Pairs
    advice_pairs: Pairs


class Program(NamedTuple):
    """Minimise cost x subject to row_lower <= matrix x <= row_upper, lower <= x <= upper.

    x = (v (n), r+ (n), r- (n), xi (|D|), zeta (|S|), eta (|S|)) with r = r+ - r-, so that |r| = r+ + r-.
    """

    cost: Floats
    matrix: sparse.csc_array
    row_lower: Floats
    row_upper: Floats
    lower: Floats
    upper: Floats


class Solution(NamedTuple):
    """An optimum of the program.

    Attributes:
        reward, value: (n,) r and v.
        slack: (|S|,) eta of the advised states.
        objective: of the maximisation.
    """

    reward: Floats
    value: Floats
    slack: Floats
    objective: float


def pose(mdp: Mdp, evidence: Evidence, terms: Terms) -> Problem:
    """Equation (1) for the evidence, in the reading that the terms name."""
    replace = terms.reading == 'replace'
    demonstrated = np.flatnonzero(evidence.favourite >= 0)
    if replace:
        demonstrated = np.setdiff1d(demonstrated, list(evidence.advice))
    advice_pairs = _advice_pairs(mdp, evidence.advice)
    return Problem(
        mdp, terms, _mixed(mdp, evidence, replace), demonstrated, np.unique(advice_pairs.states),
        _demonstration_pairs(mdp, evidence.favourite, demonstrated), advice_pairs,
    )


def _mixed(mdp: Mdp, evidence: Evidence, replace: bool) -> sparse.csr_array:
    """Pbar: the demonstrated action, the mix of preferred actions, or the mix of all actions."""
    share = np.full((mdp.n_states, mdp.n_actions), 1.0 / mdp.n_actions)
    known = np.flatnonzero(evidence.favourite >= 0)
    share[known] = 0.0
    share[known, evidence.favourite[known]] = 1.0
    for state, preference in evidence.advice.items() if replace else ():
        share[state] = 0.0
        share[state, list(preference.preferred)] = 1.0 / len(preference.preferred)
    return mdp.under(share)


def _demonstration_pairs(mdp: Mdp, favourite: Ints, demonstrated: Ints) -> Pairs:
    states = np.repeat(demonstrated, mdp.n_actions)
    worse = np.tile(np.arange(mdp.n_actions), len(demonstrated))
    other = worse != favourite[states]
    return Pairs(states[other], favourite[states][other], worse[other])


def _advice_pairs(mdp: Mdp, advice: Mapping[int, Preference]) -> Pairs:
    rows = [(state, better, worse) for state in sorted(advice) for better, worse in advice[state].pairs]
    pairs = Pairs(*np.array(rows, dtype=np.int64).reshape(-1, 3).T)
    told_apart = abs(pairs.differences(mdp)).sum(axis=1) > 0
    return Pairs(*(column[told_apart] for column in pairs))


def write(problem: Problem) -> Program:
    """The program as one sparse matrix."""
    n, terms = problem.mdp.n_states, problem.terms
    n_d, n_s = len(problem.demonstrated), len(problem.advised)
    identity = sparse.eye_array(n)
    xi = _belongs(problem.demonstration_pairs.states, problem.demonstrated)
    zeta = _belongs(problem.advice_pairs.states, problem.advised)
    matrix = sparse.block_array([
        [identity - problem.mdp.gamma * problem.mixed, -identity, identity, None, None, None],
        [problem.demonstration_pairs.differences(problem.mdp), None, None, -xi, None, None],
        [problem.advice_pairs.differences(problem.mdp), None, None, None, -zeta, zeta],
    ], format='csc')
    cap = terms.margin_cap if terms.margin_cap > 0 else np.inf
    slack = np.inf if terms.slack_cost > 0 else 0.0
    sizes = (n, n, n, n_d, n_s, n_s)
    rows = (n, xi.shape[0], zeta.shape[0])
    return Program(
        cost=np.repeat([0.0, 1.0, 1.0, -terms.lambda_t, -terms.lambda_a, terms.slack_cost], sizes),
        matrix=matrix,
        row_lower=np.repeat([0.0, 0.0, terms.delta], rows),
        row_upper=np.repeat([0.0, np.inf, np.inf], rows),
        lower=np.repeat([-np.inf, 0.0, 0.0, -np.inf, 0.0, 0.0], sizes),
        upper=np.repeat([np.inf, terms.r_max, terms.r_max, cap, cap, slack], sizes),
    )


def _belongs(states: Ints, owners: Ints) -> sparse.csr_array:
    """(len(states), len(owners)) ones where a row's state is the column's."""
    m = len(states)
    return sparse.csr_array(
        (np.ones(m), np.searchsorted(owners, states), np.arange(m + 1)), shape=(m, len(owners))
    )
