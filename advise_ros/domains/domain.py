"""A decision process whose reward is known to the evaluation alone, and how a policy's performance is measured in it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np

from advise_ros.core.errors import InputError
from advise_ros.core.numerics import Bools, Floats, Ints, is_best
from advise_ros.core.planning.process import FiniteProcess, Mdp, plan

DISTRIBUTION_TOLERANCE = 1e-6


class Measure(Enum):
    """What the figures show; the value is the axis label."""

    GOAL = 'goal reached [%]'
    WAIT = 'mean wait [cars]'
    RETURN = 'mean reward a step'

    @property
    def higher_is_better(self) -> bool:
        """Whether more of it is better."""
        return self is not Measure.WAIT


@dataclass(frozen=True, eq=False)
class Domain:
    """A decision process with its task.

    Attributes:
        name: as in the figures.
        mdp: transitions and the discount that learning and planning use.
        reward: (n,) true reward; wait is its negative.
        ended: (n,) states that are never left; no action is chosen there and nothing asked.
        goal: (n,) states that count as success.
        start: (n,) where an evaluated policy starts, a distribution.
        measure: of performance.
        horizon: steps that a policy has, e.g. what the battery allows.
        features: (n, f) structure of the states for clusterings that use it, in comparable units.
        actions: names.

    Raises:
        InputError: a part has the wrong shape, or `start` is no distribution.
    """

    name: str
    mdp: Mdp
    reward: Floats
    ended: Bools
    goal: Bools
    start: Floats
    measure: Measure
    horizon: int
    features: Floats
    actions: tuple[str, ...]

    def __post_init__(self) -> None:
        n = self.mdp.n_states
        for part in ('reward', 'ended', 'goal', 'start', 'features'):
            array = getattr(self, part)
            if len(array) != n:
                raise InputError(f"'{part}' of domain {self.name} has {len(array)} rows; it needs one a state, {n}")
            array.setflags(write=False)
        if (self.start < 0).any() or abs(float(self.start.sum()) - 1.0) > DISTRIBUTION_TOLERANCE:
            raise InputError(f"'start' of domain {self.name} sums to {self.start.sum():g}; it must be a distribution")

    @cached_property
    def process(self) -> FiniteProcess:
        """What the learner sees of it."""
        return FiniteProcess(self.mdp, self.acting, self.features, self.start)

    @cached_property
    def acting(self) -> Ints:
        """States in which one acts, ascending."""
        return np.flatnonzero(~self.ended)

    @cached_property
    def optimal(self) -> Bools:
        """(n, n_actions) optimal actions under the true reward; none where the task has ended."""
        best = is_best(plan(self.mdp, self.reward).q)
        best[self.ended] = False
        return best

    @cached_property
    def habit(self) -> Ints:
        """(n,) the optimal action of lowest index, the class of a state; -1 where the task has ended."""
        return np.where(self.ended, -1, self.optimal.argmax(axis=1))

    def performance(self, policy: Floats) -> float:
        """Exact expected performance of a policy from `start`, in the measure's unit.

        Args:
            policy: (n, n_actions) probabilities.
        """
        backwards = self.mdp.under(policy).T.tocsr()
        here, collected = self.start, 0.0
        for _ in range(self.horizon):
            collected += float(here @ self.reward)
            here = backwards @ here
        if self.measure is Measure.GOAL:
            return 100.0 * float(here @ self.goal)
        mean = collected / self.horizon
        return -mean if self.measure is Measure.WAIT else mean

    @cached_property
    def best_performance(self) -> float:
        """Of the optimal policy."""
        return self.performance(split_ties(self.optimal))


def split_ties(best: Bools) -> Floats:
    """(n, n_actions) policy that divides itself evenly among the best actions; among all where none is.

    Args:
        best: (n, n_actions) which actions are best.
    """
    chosen = np.where(best.any(axis=1, keepdims=True), best, True)
    shares: Floats = chosen / chosen.sum(axis=1, keepdims=True)
    return shares


def uniform_over(states: Bools) -> Floats:
    """(n,) the uniform distribution over some states.

    Args:
        states: (n,) which.
    """
    share: Floats = states / states.sum()
    return share
