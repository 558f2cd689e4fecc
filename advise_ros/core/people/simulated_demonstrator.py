"""The simulated demonstrator of section 4, in any process.

The paper's demonstrators make *systematic errors in certain kinds of states*; the paper does not say which. Here a kind of
states is those with the same optimal action, and in all states of a kind that he gets wrong, a demonstrator makes the
same mistake. About 10 % of his actions are random.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from advise_ros.core.demonstrations.demonstration import Counts
from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.planning.process import FiniteProcess, Mdp


@dataclass(frozen=True)
class Demonstrator:
    """A demonstrator with errors.

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


class KnownTask(Protocol):
    """A process, and what is right in it.

    Attributes:
        process: transitions, acting states, and where an evaluated policy starts.
        optimal: (n, n_actions) the right actions; none where no action is chosen.
        habit: (n,) the right action of lowest index, the kind of a state; -1 where no action is chosen.
    """

    @property
    def process(self) -> FiniteProcess: ...

    @property
    def optimal(self) -> Bools: ...

    @property
    def habit(self) -> Ints: ...


def draw_mistakes(task: KnownTask, person: Demonstrator, rng: np.random.Generator) -> Ints:
    """(n,) the wrong action of each state, -1 where there is none.

    One kind of states after the other, each with one wrong action, until the share of the states is reached.
    """
    acting, n = task.process.acting, len(task.optimal)
    left = round(person.mistake_share * len(acting))
    wrong = np.full(n, -1)
    alike = np.arange(n) if person.kinds == 'each' else task.habit
    kinds, sizes = np.unique(alike[acting], return_counts=True)
    order = np.argsort(-sizes, kind='stable') if person.kinds == 'largest' else rng.permutation(len(kinds))
    for kind in kinds[order]:
        states = rng.permutation(np.flatnonzero(alike == kind))
        action = _wrong_action(task.optimal[states], rng)
        states = states[~task.optimal[states, action]][:left]
        wrong[states] = action
        left -= len(states)
    return wrong


def _wrong_action(optimal: Bools, rng: np.random.Generator) -> int:
    """One that is wrong in as many of the states as any."""
    right = optimal.sum(axis=0)
    return int(rng.choice(np.flatnonzero(right == right.min())))


def behaviour(task: KnownTask, person: Demonstrator, mistakes: Ints) -> Floats:
    """(n, n_actions) probability that the person takes each action in each state.

    Args:
        task: the process with its reward.
        person: how often errors are made.
        mistakes: (n,) as of `draw_mistakes`.
    """
    n, n_actions = task.optimal.shape
    acting = task.process.acting
    shares = np.zeros((n, n_actions))
    shares[acting, task.habit[acting]] = 1.0
    states = np.flatnonzero(mistakes >= 0)
    shares[states] *= 1.0 - person.mistake_rate
    shares[states, mistakes[states]] += person.mistake_rate
    return (1.0 - person.noise_rate) * shares + person.noise_rate / n_actions


def demonstrate_task(task: KnownTask, person: Demonstrator, rng: np.random.Generator) -> Counts:
    """What all demonstrations of one person did in each state."""
    process, n = task.process, len(task.optimal)
    shares = behaviour(task, person, draw_mistakes(task, person, rng))
    acts = np.zeros(n, dtype=np.bool_)
    acts[process.acting] = True
    start = acts / acts.sum() if person.restarts == 'uniform' else process.start
    here = rng.choice(n, size=person.demonstrations, p=start)
    taken = np.zeros(shares.shape, dtype=np.int64)
    cumulative = shares.cumsum(axis=1)
    for _ in range(person.steps):
        here = here[acts[here]]
        actions = (cumulative[here] < rng.random((len(here), 1))).sum(axis=1).clip(max=shares.shape[1] - 1)
        np.add.at(taken, (here, actions), 1)
        here = _step(process.mdp, here, actions, rng)
    return Counts(taken)


def _step(mdp: Mdp, states: Ints, actions: Ints, rng: np.random.Generator) -> Ints:
    """(m,) a successor of each of m states."""
    outcomes = mdp.outcomes(states, actions)
    # Each row sums to 1, so the running sum over all rows passes from one row to the next at whole numbers.
    reached = np.searchsorted(outcomes.data.cumsum(), np.arange(len(states)) + rng.random(len(states)), side='right')
    return outcomes.indices[reached.clip(outcomes.indptr[:-1], outcomes.indptr[1:] - 1)].astype(np.int64)
