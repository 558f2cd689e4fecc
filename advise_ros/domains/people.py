"""The simulated demonstrator and expert of section 4, in any domain.

The paper's demonstrators make *systematic errors in certain kinds of states*; which, it does not tell. Here a kind of
states is those with the same optimal action, and in all states of a kind that he gets wrong, a demonstrator makes the
same mistake. About 10 % of his actions are random.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from advise_ros.core.demonstrations.action_counts import Counts
from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.planning.process import Mdp
from advise_ros.domains.domain import Domain, uniform_over


@dataclass(frozen=True)
class Demonstrator:
    """Someone who shows what to do and is often wrong.

    Attributes:
        demonstrations: how many.
        steps: of each, at most.
        restarts: 'uniform' starts each anywhere, 'start' where an evaluated policy starts.
        kinds: of states that he gets wrong, 'any' or the 'largest' first; 'each': states for themselves, without habits.
        mistake_share: share of the states that he gets wrong again and again.
        mistake_rate: share of the actions there that are the mistake.
        noise_rate: share of the actions, everywhere, that are random.
    """

    demonstrations: int
    steps: int
    restarts: str = 'uniform'
    kinds: str = 'any'
    mistake_share: float = 0.25
    mistake_rate: float = 0.75
    noise_rate: float = 0.1


class Mistakes(NamedTuple):
    """(n,) the wrong action of each state, -1 where there is none."""

    action: Ints


def draw_mistakes(domain: Domain, person: Demonstrator, rng: np.random.Generator) -> Mistakes:
    """One kind of states after the other, each with one wrong action, until the share of the states is reached."""
    left = round(person.mistake_share * len(domain.acting))
    wrong = np.full(domain.mdp.n_states, -1)
    alike = np.arange(domain.mdp.n_states) if person.kinds == 'each' else domain.habit
    kinds, sizes = np.unique(alike[domain.acting], return_counts=True)
    order = np.argsort(-sizes, kind='stable') if person.kinds == 'largest' else rng.permutation(len(kinds))
    for kind in kinds[order]:
        states = rng.permutation(np.flatnonzero(alike == kind))
        action = _wrong_action(domain.optimal[states], rng)
        states = states[~domain.optimal[states, action]][:left]
        wrong[states] = action
        left -= len(states)
    return Mistakes(wrong)


def _wrong_action(optimal: Bools, rng: np.random.Generator) -> int:
    """One that is wrong in as many of the states as any."""
    right = optimal.sum(axis=0)
    return int(rng.choice(np.flatnonzero(right == right.min())))


def behaviour(domain: Domain, person: Demonstrator, mistakes: Mistakes) -> Floats:
    """(n, n_actions) how often the person takes each action in each state."""
    n, n_actions = domain.optimal.shape
    shares = np.zeros((n, n_actions))
    shares[domain.acting, domain.habit[domain.acting]] = 1.0
    states = np.flatnonzero(mistakes.action >= 0)
    shares[states] *= 1.0 - person.mistake_rate
    shares[states, mistakes.action[states]] += person.mistake_rate
    return (1.0 - person.noise_rate) * shares + person.noise_rate / n_actions


def demonstrate(domain: Domain, person: Demonstrator, rng: np.random.Generator) -> Counts:
    """What all demonstrations of one person did in each state."""
    shares = behaviour(domain, person, draw_mistakes(domain, person, rng))
    start = uniform_over(~domain.ended) if person.restarts == 'uniform' else domain.start
    here = rng.choice(domain.mdp.n_states, size=person.demonstrations, p=start)
    taken = np.zeros(shares.shape, dtype=np.int64)
    cumulative = shares.cumsum(axis=1)
    for _ in range(person.steps):
        here = here[~domain.ended[here]]
        actions = (cumulative[here] < rng.random((len(here), 1))).sum(axis=1).clip(max=shares.shape[1] - 1)
        np.add.at(taken, (here, actions), 1)
        here = _step(domain.mdp, here, actions, rng)
    return Counts(taken)


def _step(mdp: Mdp, states: Ints, actions: Ints, rng: np.random.Generator) -> Ints:
    """(m,) a successor of each of m states."""
    outcomes = mdp.outcomes(states, actions)
    # Each row sums to 1, so the running sum over all rows passes from one row to the next at whole numbers.
    reached = np.searchsorted(outcomes.data.cumsum(), np.arange(len(states)) + rng.random(len(states)), side='right')
    return outcomes.indices[reached.clip(outcomes.indptr[:-1], outcomes.indptr[1:] - 1)].astype(np.int64)


@dataclass(frozen=True)
class Expert:
    """Someone who answers, right unless told otherwise.

    Attributes:
        avoid: 'never_optimal' avoids what is optimal in none of the cluster's states (all others where there is no
            such action), 'all_others' whatever is not preferred.
        error_rate: share of the answers that are wrong.
        skip_rate: share of the questions that are not answered; they cost a question.
    """

    avoid: str = 'never_optimal'
    error_rate: float = 0.0
    skip_rate: float = 0.0


class Advice(NamedTuple):
    """Actions preferred and avoided, each ascending."""

    preferred: tuple[int, ...]
    avoided: tuple[int, ...]


def advise(expert: Expert, optimal: Bools, rng: np.random.Generator) -> Advice | None:
    """The answer about states with the optimal actions (m, n_actions); None when skipped or nothing is to avoid.

    Preferred are the actions that are optimal in most of the states, the paper's choice.
    """
    skips, errs = rng.random(2) < (expert.skip_rate, expert.error_rate)
    votes = optimal.sum(axis=0)
    preferred = np.flatnonzero(votes == votes.max())
    others, never = np.flatnonzero(votes < votes.max()), np.flatnonzero(votes == 0)
    avoided = others if expert.avoid == 'all_others' or not len(never) else never
    if skips or not len(avoided):
        return None
    if errs:
        return Advice((int(rng.choice(avoided)),), tuple(preferred.tolist()))
    return Advice(tuple(preferred.tolist()), tuple(avoided.tolist()))
