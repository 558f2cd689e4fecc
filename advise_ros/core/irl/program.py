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
outcome are indistinguishable: an advised pair of them makes no row, and a demonstrated state with such an
alternative has no margin above 0.

`pose` states the program for any process, `core/irl/solvers/choose.py` solves it:

    mdp = from_transitions(n_states, n_actions, 0.95, transitions)
    favourite = favourites(n_states, n_actions, demo_states, demo_actions)
    solution = solve(pose(mdp, Evidence(favourite, advice), Terms()))
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy import sparse

from advise_ros.core.advice.advice import Preference
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.irl.settings import Terms
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.planning.process import Mdp

# The relative gap up to which a solution is called optimal.
EXACT = 1e-6
# More slack than this share of delta is advice not met, less is the solver's tolerance.
SLACK_SHARE = 1e-3


class InfeasibleError(AdviseError):
    """No reward satisfies the strict advice."""


class Evidence(NamedTuple):
    """What the program learns from.

    Attributes:
        favourite: (n,) the most demonstrated action a*, -1 without a demonstration.
        advice: preference of each advised state.
    """

    favourite: Ints
    advice: Mapping[int, Preference]


class Pairs(NamedTuple):
    """Margin rows: in `states`, ascending, `better` is to be worth more than `worse`; each (m,)."""

    states: Ints
    better: Ints
    worse: Ints

    def differences(self, mdp: Mdp) -> sparse.csr_array:
        """(m, n) rows P_better - P_worse."""
        return mdp.outcomes(self.states, self.better) - mdp.outcomes(self.states, self.worse)

    def margins(self, expected: Floats) -> Floats:
        """(m,) the rows times v.

        Args:
            expected: (n_actions, n) `Mdp.expected` of v.
        """
        return expected[self.better, self.states] - expected[self.worse, self.states]

    def weighted(self, mdp: Mdp, weights: Floats) -> Floats:
        """(n,) the transposed rows times weights.

        Args:
            mdp: the process.
            weights: (m,).
        """
        n, shape = mdp.n_states, mdp.n_states * mdp.n_actions
        share = np.bincount(self.better * n + self.states, weights, shape)
        return mdp.stacked.T @ (share - np.bincount(self.worse * n + self.states, weights, shape))

    def of(self, owners: Ints) -> Ints:
        """(m,) the position of each row's state in `owners`.

        Args:
            owners: (k,) states, ascending.
        """
        return np.searchsorted(owners, self.states)


class Problem(NamedTuple):
    """The program before it is written as a matrix: what every solver reads.

    Attributes:
        shares: (n, n_actions) the mix of actions that Pbar is made of.
        mixed: (n, n) Pbar.
        demonstrated: D ascending.
        caps: (|D|,) the largest xi of each, infinite without a bound, 0 beside an action of the same outcome.
        advised: S ascending, the advised states that have a row.
        demonstration_pairs: a row for each other action of each demonstrated state.
        advice_pairs: the rows of the advice, none of them zero.
    """

    mdp: Mdp
    terms: Terms
    shares: Floats
    mixed: sparse.csr_array
    demonstrated: Ints
    caps: Floats
    advised: Ints
    demonstration_pairs: Pairs
    advice_pairs: Pairs

    def backup(self, value: Floats) -> Floats:
        """(n,) the reward that a value belongs to, r = v - gamma Pbar v.

        Args:
            value: (n,) v.
        """
        return value - self.mdp.gamma * (self.mixed @ value)

    def backup_transposed(self, flow: Floats) -> Floats:
        """(n,) y - gamma Pbar' y.

        Args:
            flow: (n,) y.
        """
        return flow - self.mdp.gamma * (self.mixed.T @ flow)


class Duals(NamedTuple):
    """Multipliers of the rows: y of v = r + gamma Pbar v (n,), w of the demonstration and z of the advice pairs."""

    flow: Floats
    demonstration: Floats
    advice: Floats


class Solution(NamedTuple):
    """A point of the program, and how far from the optimum it can be.

    Attributes:
        reward, value: (n,) r and v.
        xi: (|D|,) margins of the demonstrated states.
        zeta, slack: (|S|,) margins and eta of the advised states.
        objective: of the maximisation, at this point.
        bound: proven: no point has a higher objective.
        solver: its name.
        duals: what proves the bound.
    """

    reward: Floats
    value: Floats
    xi: Floats
    zeta: Floats
    slack: Floats
    objective: float
    bound: float
    solver: str
    duals: Duals

    @property
    def gap(self) -> float:
        """Relative distance to the proven bound."""
        return max(0.0, self.bound - self.objective) / max(1.0, abs(self.objective))

    @property
    def status(self) -> str:
        """'optimal' up to `EXACT`, otherwise 'approximate'."""
        return 'optimal' if self.gap <= EXACT else 'approximate'


def favourites(n_states: int, n_actions: int, states: Ints, actions: Ints) -> Ints:
    """(n,) a*: the most frequent action of each state, ties to the lowest; -1 without a move.

    Args:
        n_states, n_actions: sizes.
        states, actions: (k,) demonstrated moves; repeats count.
    """
    taken = np.bincount(states * n_actions + actions, minlength=n_states * n_actions).reshape(n_states, n_actions)
    return np.where(taken.any(axis=1), taken.argmax(axis=1), -1)


def pose(mdp: Mdp, evidence: Evidence, terms: Terms) -> Problem:
    """Equation (1) for the evidence, in the reading that the terms name.

    Raises:
        InputError: the terms leave the program unbounded.
    """
    _check(mdp, terms)
    replace = terms.reading == 'replace'
    demonstrated = evidence.favourite >= 0
    if replace:
        demonstrated[list(evidence.advice)] = False
    states = np.flatnonzero(demonstrated)
    indistinct = mdp.alike[states, evidence.favourite[states]].sum(axis=1) > 1
    advised, advice_pairs = advice_rows(mdp, evidence.advice)
    shares = _shares(mdp, evidence, replace)
    return Problem(
        mdp, terms, shares, mdp.under(shares), states, np.where(indistinct, 0.0, terms.cap),
        advised, _demonstration_pairs(mdp, evidence.favourite, states), advice_pairs,
    )


def _check(mdp: Mdp, terms: Terms) -> None:
    if mdp.n_actions < 2:
        raise InputError('the process has one action only; there is nothing to choose or to learn')
    if terms.cap == np.inf and 0 < terms.slack_cost < terms.lambda_a:
        raise InputError(
            f'slack_cost {terms.slack_cost:g} is less than lambda_a {terms.lambda_a:g}, and without margin_cap that '
            'pays for any slack; raise slack_cost or set margin_cap'
        )


def _shares(mdp: Mdp, evidence: Evidence, replace: bool) -> Floats:
    """What Pbar mixes: the demonstrated action, the mix of preferred actions, or the mix of all actions."""
    share = np.full((mdp.n_states, mdp.n_actions), 1.0 / mdp.n_actions)
    known = np.flatnonzero(evidence.favourite >= 0)
    share[known] = 0.0
    share[known, evidence.favourite[known]] = 1.0
    for preference, states in _alike(evidence.advice).items() if replace else ():
        share[states] = 0.0
        share[np.ix_(states, preference.preferred)] = 1.0 / len(preference.preferred)
    return share


def _alike(advice: Mapping[int, Preference]) -> dict[Preference, list[int]]:
    """States of equal advice together: there are few different answers and many states."""
    groups: dict[Preference, list[int]] = {}
    for state, preference in advice.items():
        groups.setdefault(preference, []).append(state)
    return groups


def _demonstration_pairs(mdp: Mdp, favourite: Ints, demonstrated: Ints) -> Pairs:
    states = np.repeat(demonstrated, mdp.n_actions)
    worse = np.tile(np.arange(mdp.n_actions), len(demonstrated))
    other = worse != favourite[states]
    return Pairs(states[other], favourite[states][other], worse[other])


def advice_rows(mdp: Mdp, advice: Mapping[int, Preference]) -> tuple[Ints, Pairs]:
    """S and its rows, ascending in state, preferred and avoided action; actions with the same outcome have none."""
    asked = np.array(sorted(advice), dtype=np.int64)
    wanted = np.zeros((len(asked), mdp.n_actions, mdp.n_actions), dtype=np.bool_)
    for preference, states in _alike(advice).items():
        better, worse = np.array(preference.pairs, dtype=np.int64).reshape(-1, 2).T
        wanted[np.searchsorted(asked, states)[:, None], better, worse] = True
    which, better, worse = np.nonzero(wanted & ~mdp.alike[asked])
    pairs = Pairs(asked[which], better, worse)
    return np.unique(pairs.states), pairs


def slack_states(problem: Problem, solution: Solution) -> Ints:
    """The advised states with slack."""
    return problem.advised[solution.slack > SLACK_SHARE * max(problem.terms.delta, SLACK_SHARE)]
