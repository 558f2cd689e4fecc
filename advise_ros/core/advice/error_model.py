"""How likely each action is the right one in each state, from the moves of a person with errors.

In most states a person takes the right action but for slips; in the others he takes the same wrong one again and
again, and the right one now and then. How often he slips, how often he takes his mistake where he has one, and which
mistakes he makes for which right actions, is estimated from all states together by expectation maximisation, with a
prior that a few hundred moves outweigh.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from advise_ros.core.numerics import Floats, Ints

# Share of right actions in a state without a mistake; in one with a mistake, shares of the right one and of the mistake.
RIGHT, RESCUED, MISTAKEN = 0.9, 0.22, 0.7
# The share of the states with a mistake.
MISTAKES = 0.25
# Moves and states that the prior weighs as much as.
PRIOR_MOVES, PRIOR_STATES = 20.0, 4.0
ROUNDS = 10
# Bounds that keep one person's extremes from being taken for certainty.
MOST_RIGHT, MOST_TOGETHER = 0.98, 0.98
RESCUED_BOUNDS = (0.05, 0.45)
LEAST_OTHER = 1e-4
# A demonstrator is taken to make mistakes when the moves are this many times likelier than without any.
EVIDENCE = 1000.0
# A demonstrator with mistakes in a larger share of the states does not show what is right.
MOST_MISTAKES = 0.5


class _ErrorModel(NamedTuple):
    """How a demonstrator errs.

    Attributes:
        right: share of right actions in states without a mistake.
        rescued, mistaken: shares of the right action and of the mistake in states with one.
        pairs: (n_actions, n_actions) share of the states with this right action and that mistake, none on the diagonal.
    """

    right: float
    rescued: float
    mistaken: float
    pairs: Floats

    def log_joint(self, taken: Floats) -> Floats:
        """(m, n_actions, n_actions) log probability of the counts with each right action and mistake."""
        n_actions, visits = taken.shape[1], taken.sum(axis=1)
        other = max((1.0 - self.rescued - self.mistaken) / max(n_actions - 2, 1), LEAST_OTHER)
        rest = visits[:, None, None] - taken[:, :, None] - taken[:, None, :]
        with np.errstate(divide='ignore'):  # A pair that the prior rules out stays so.
            pairs = np.log(self.pairs)
        joint: Floats = pairs + taken[:, :, None] * np.log(self.rescued) + (
            taken[:, None, :] * np.log(self.mistaken) + rest * np.log(other)
        )
        slip = (1.0 - self.right) / (n_actions - 1)
        honest = taken * np.log(self.right) + (visits[:, None] - taken) * np.log(slip)
        every = np.arange(n_actions)
        joint[:, every, every] = np.diag(pairs) + honest
        return joint

    def log_likelihood(self, taken: Floats, weight: Ints) -> float:
        """Of counts (m, n_actions), each of them seen in `weight` (m,) states."""
        return float(weight @ logsumexp(self.log_joint(taken), axis=(1, 2)))


def shares(logs: Floats) -> Floats:
    """Probabilities from log probabilities up to a constant.

    Args:
        logs: (..., n_actions).

    Returns:
        (..., n_actions), each row sums to 1.
    """
    weight = np.exp(logs - logs.max(axis=-1, keepdims=True))
    normal: Floats = weight / weight.sum(axis=-1, keepdims=True)
    return normal


def log_beliefs(taken: Ints) -> Floats:
    """(m, n_actions) log probability that an action is right, up to a constant a state.

    Args:
        taken: (m, n_actions) demonstrated actions.
    """
    logs = _remembered(taken.astype(np.int64).tobytes(), taken.shape[1])
    return np.frombuffer(logs).reshape(taken.shape)


@lru_cache(maxsize=16)
def _remembered(moves: bytes, n_actions: int) -> bytes:
    """Remembered, because answers do not change the demonstrations."""
    counts, weight, which = _alike(moves, n_actions)
    person = _fit_error_model(counts, weight, _prior(n_actions))
    joint = shares(person.log_joint(counts).reshape(len(counts), -1)).reshape(len(counts), *person.pairs.shape)
    logs: Floats = np.log(np.maximum(joint.sum(axis=2), np.finfo(float).tiny))
    return logs[which].tobytes()


def mistakes_shown(taken: Ints) -> bool:
    """Whether the moves leave no doubt that their person makes mistakes, in the lesser part of the states.

    A mistake made nearly always looks like what is right with slips: without this, beliefs could turn what an errorless
    person shows into its opposite.

    Args:
        taken: (m, n_actions) how often each action was taken in each state.
    """
    return _shown(taken.astype(np.int64).tobytes(), taken.shape[1])


@lru_cache(maxsize=16)
def _shown(moves: bytes, n_actions: int) -> bool:
    counts, weight, _ = _alike(moves, n_actions)
    anyone = _prior(n_actions)
    flawless = anyone._replace(pairs=np.eye(n_actions) / n_actions)
    erring, without = (_fit_error_model(counts, weight, prior) for prior in (anyone, flawless))
    evidence = erring.log_likelihood(counts, weight) - without.log_likelihood(counts, weight)
    return bool(evidence >= np.log(EVIDENCE) and 1.0 - np.trace(erring.pairs) <= MOST_MISTAKES)


def _alike(moves: bytes, n_actions: int) -> tuple[Floats, Ints, Ints]:
    """The distinct rows of counts, how many visited states have each, and the row of each state."""
    taken = np.frombuffer(moves, dtype=np.int64).reshape(-1, n_actions)
    rows, which, weight = np.unique(taken, axis=0, return_inverse=True, return_counts=True)
    return rows.astype(np.float64), weight * (rows.sum(axis=1) > 0), which.ravel()


def _prior(n_actions: int) -> _ErrorModel:
    pairs = np.full((n_actions, n_actions), MISTAKES / (n_actions - 1) / n_actions)
    np.fill_diagonal(pairs, (1.0 - MISTAKES) / n_actions)
    return _ErrorModel(RIGHT, RESCUED, MISTAKEN, pairs)


def _fit_error_model(taken: Floats, weight: Ints, prior: _ErrorModel) -> _ErrorModel:
    """EM estimate of the demonstrator's error model from counts (m, n_actions), each seen in `weight` (m,) states."""
    person = prior
    for _ in range(ROUNDS):
        person = _fitted(person, taken, weight, prior.pairs)
    return person


def _fitted(person: _ErrorModel, taken: Floats, weight: Ints, pairs: Floats) -> _ErrorModel:
    """One round of expectation maximisation; `pairs` are those of the prior."""
    joint = person.log_joint(taken)
    share = shares(joint.reshape(len(joint), -1)).reshape(joint.shape) * weight[:, None, None]
    visits, honest = taken.sum(axis=1), np.diagonal(share, axis1=1, axis2=2)
    wrong = share.copy()
    np.einsum('saa->sa', wrong)[:] = 0.0
    rescued = _rate((wrong * taken[:, :, None]).sum(), (wrong * visits[:, None, None]).sum(), RESCUED)
    mistaken = _rate((wrong * taken[:, None, :]).sum(), (wrong * visits[:, None, None]).sum(), MISTAKEN)
    rescued = min(max(rescued, RESCUED_BOUNDS[0]), RESCUED_BOUNDS[1])
    scale = min(1.0, MOST_TOGETHER / (rescued + mistaken))
    found = share.sum(axis=0) + PRIOR_STATES * pairs
    right = _rate((honest * taken).sum(), (honest * visits[:, None]).sum(), RIGHT)
    return _ErrorModel(min(right, MOST_RIGHT), scale * rescued, scale * mistaken, found / found.sum())


def _rate(successes: float, moves: float, prior: float) -> float:
    return float((successes + PRIOR_MOVES * prior) / (moves + PRIOR_MOVES))
