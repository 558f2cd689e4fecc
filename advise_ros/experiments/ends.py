"""Wumpus World and Sailing with the structure that only the ends matter: each end is good or bad, and nothing else is.

As on routes (core/site) the reward is not free in every state: each cell in which the process ends is worth +1 or -1, whatever
the wind. The sign patterns are few enough to look at all of them: how likely each makes the moves of a person with habits and
mistakes, and the answers of the expert. The policy is optimal for the mean reward; asked is the state whose answer is expected
to be worth most. Only these experiments use it: it is given that only ends matter, which the paper's learner is not.
"""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp, softmax

from advise_ros.core.numerics import Bools, Floats, Ints, is_best
from advise_ros.core.people.simulated_expert import Reply, reply
from advise_ros.core.planning.process import plan
from advise_ros.core.site.belief import OTHERWISE, RIGHT, WRONG_ANSWERS
from advise_ros.core.site.pilots import HABIT, MISTAKE, MOST_MOVES, NEVER, SHARES, SLIPS
from advise_ros.domains.domain import Domain, split_ties
from advise_ros.experiments.trial import DECIMALS, Shown

# A good end has this log odds against a bad one: goals are few.
GOAL_PRICE = 2.0
# A question is asked if its answer is expected to add so much to the value of the start.
LEAST_WORTH = 0.02
# Half of what questions are weighed by doubts the moves: they count one in so many.
DOUBT = 3.0
# Patterns less likely than this decide no question.
POSSIBLE = 1e-6


class Ends(NamedTuple):
    """Every way in which the ends can be good and bad.

    Attributes:
        rewards: (k, n) of each pattern.
        optimal: (k, n, n_actions) the right actions under each.
        log_prior: (k,).
    """

    rewards: Floats
    optimal: Bools
    log_prior: Floats


def ends_of(domain: Domain) -> Ends:
    """The patterns of a domain whose first two features are a place; at least one end is good."""
    ended = np.flatnonzero(domain.ended)
    places, place_of = np.unique(domain.features[ended, :2], axis=0, return_inverse=True)
    signs = np.array([signs for signs in product((-1.0, 1.0), repeat=len(places)) if max(signs) > 0.0])
    rewards = np.zeros((len(signs), domain.mdp.n_states))
    rewards[:, ended] = signs[:, place_of.ravel()]
    optimal = np.array([is_best(plan(domain.mdp, reward).q) & ~domain.ended[:, None] for reward in rewards])
    return Ends(rewards, optimal, -GOAL_PRICE * (signs > 0.0).sum(axis=1))


def interview(shown: Shown, budget: int) -> tuple[list[float], list[float]]:
    """Performance after 0, 1, ... answers until no question is worth asking, and what the best one was worth then."""
    domain, expert, rng = shown.domain, shown.protocol.expert, shown.generator('expert')
    ends = ends_of(domain)
    moves, other = log_moves(shown.counts.taken[domain.acting], ends.optimal[:, domain.acting]), ends.log_prior
    performance, doubts = [], []
    while True:
        believed, doubting = softmax(other + moves), softmax(other + moves / DOUBT)
        q = plan(domain.mdp, believed @ ends.rewards).q
        performance.append(round(domain.performance(split_ties(is_best(q))), DECIMALS))
        state, worth = best_question(domain, ends, (believed + doubting) / 2.0)
        doubts.append(round(worth, DECIMALS))
        if worth < LEAST_WORTH or len(performance) > budget:
            return performance, doubts
        other = other + log_answer(ends.optimal[:, state], reply(expert, domain.optimal[[state]], rng))


def log_moves(taken: Ints, optimal: Bools) -> Floats:
    """(k,) log likelihood of moves (m, n_actions) in m states if these actions (k, m, n_actions) are right.

    The model of `core/site/pilots.Mistaken` without walls: one of the right actions is a habit, slips are as likely to all wrong
    ones, and in a share of the states the same mistake is made again and again. The shares that make the best pattern most
    likely.
    """
    scale = np.minimum(1.0, MOST_MOVES / np.maximum(taken.sum(axis=1), 1))
    counts = taken * scale[:, None]
    fits = [_log_moves(counts, optimal, slip, share) for slip, share in product(SLIPS, SHARES)]
    return max(fits, key=lambda logs: float(logs.max()))


def _log_moves(counts: Floats, optimal: Bools, slip: float, share: float) -> Floats:
    n_actions = optimal.shape[2]
    number, eye = np.maximum(optimal.sum(axis=2, keepdims=True), 1), np.eye(n_actions)
    wrong = ~optimal / np.maximum((~optimal).sum(axis=2, keepdims=True), 1)
    right = (1.0 - HABIT) * (optimal / number)[:, :, None] + HABIT * eye  # (k, m, habit, action)
    sound = (1.0 - slip) * right + slip * wrong[:, :, None]
    erring = (1.0 - MISTAKE) * right[:, :, :, None] + MISTAKE * eye  # (k, m, habit, mistake, action)
    kinds = np.concatenate([sound[:, :, :, None], erring], axis=3) + NEVER
    weights = np.concatenate([np.full_like(number, 1.0 - share, dtype=float), share * wrong], axis=2)
    prior = (optimal / number)[:, :, :, None] * weights[:, :, None]
    logs = (counts[:, None, None] * np.log(kinds)).sum(axis=-1)
    total: Floats = logsumexp(logs, axis=(2, 3), b=prior).sum(axis=1)
    return total


def log_answer(optimal: Bools, said: Reply) -> Floats:
    """(k,) log likelihood of an answer about one state whose right actions are (k, n_actions); as `core/site/belief`."""
    if said.preferred:
        preferred, avoided = (np.isin(np.arange(optimal.shape[1]), part) for part in (said.preferred, said.avoided))
    else:
        preferred, avoided = np.ones(optimal.shape[1], dtype=np.bool_), np.zeros(optimal.shape[1], dtype=np.bool_)
    differences = (optimal != preferred).sum(axis=1) + (~optimal != avoided).sum(axis=1)
    logs: Floats = np.log(RIGHT * OTHERWISE**differences + (1.0 - RIGHT) / WRONG_ANSWERS)
    return logs


def best_question(domain: Domain, ends: Ends, weights: Floats) -> tuple[int, float]:
    """The state whose answer adds most to the value of the start, on average, and how much."""
    kept = np.flatnonzero(weights > POSSIBLE)
    shares, rewards, optimal = weights[kept] / weights[kept].sum(), ends.rewards[kept], ends.optimal[kept]
    now, best = _value(domain, shares @ rewards), (-1, 0.0)
    known: dict[bytes, float] = {}
    for state in domain.acting.tolist():
        group = np.unique(optimal[:, state], axis=0, return_inverse=True)[1].ravel()
        if group.tobytes() not in known:
            parts = [group == part for part in range(group.max() + 1)]
            then = [_value(domain, shares[part] @ rewards[part] / shares[part].sum()) * shares[part].sum() for part in parts]
            known[group.tobytes()] = sum(then) - now if len(parts) > 1 else 0.0
        if known[group.tobytes()] > best[1]:
            best = (state, known[group.tobytes()])
    return best


def _value(domain: Domain, reward: Floats) -> float:
    return float(domain.start @ plan(domain.mdp, reward).value)
