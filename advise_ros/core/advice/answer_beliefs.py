"""What is believed of the right actions once answers are given: the states of one answer have much in common.

A state shares the common right action of its set with a probability, the set's purity, that the demonstrations speak for.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.advice.error_model import shares
from advise_ros.core.numerics import Floats, Ints

# The names of the acquisitions that ask by these beliefs; 'belief' also imitates what is believed (`core/learning/algorithm.py`).
GAIN, BELIEF = 'gain', 'belief'
BY_WORTH = (GAIN, BELIEF)
# Purity of a set before its demonstrations are looked at, and the number of states that this prior weighs as much as.
PURITY, PURITY_STATES = 0.85, 2
PURITY_ROUNDS = 5
ALONE = 1.0 - 1e-6
# Probability that an expert's answer is wrong ...
WRONG = 0.05
# ... and calls an action wrong everywhere that is right somewhere with this probability.
NEVER = 0.01


class Common(NamedTuple):
    """The right action that the states of a set have in common.

    Attributes:
        chance: (n_actions,) that it is this one.
        purity: (n_actions,) share of the states that have it, if it is.
        beliefs: (m, n_actions) of the states by themselves.
    """

    chance: Floats
    purity: Floats
    beliefs: Floats

    def gain(self, current: Ints, visits: Floats) -> float:
        """Expected policy visits that the answer corrects.

        Args:
            current: (m,) action that the policy takes in each state of the set.
            visits: (m,) expected visits of the policy.
        """
        rest = (1.0 - self.purity) / self.beliefs.shape[1]
        # (m, n_actions) of each answer: what it prefers, and what is done now, once it is known.
        preferred, total = self.beliefs * (self.purity + rest), self.beliefs * self.purity + rest
        now = self.beliefs[np.arange(len(current)), current][:, None] * rest
        better = np.maximum(preferred - now, 0.0) / total
        better[np.arange(len(current)), current] = 0.0
        return float(visits @ better @ self.chance)


def common(beliefs: Floats) -> Common:
    """The right action that the states of a set share.

    Args:
        beliefs: (m, n_actions) probability of each action to be right, per state of the set.
    """
    m, n_actions = beliefs.shape
    purity = np.full(n_actions, ALONE if m == 1 else PURITY)
    for _ in range(PURITY_ROUNDS if m > 1 else 0):
        shared = purity * beliefs
        sharing = (shared / (shared + (1.0 - purity) / n_actions)).sum(axis=0)
        purity = np.maximum((sharing + PURITY_STATES * PURITY) / (m + PURITY_STATES), 1.0 / m)
    likelihood = np.log(purity * beliefs + (1.0 - purity) / n_actions).sum(axis=0)
    return Common(shares(likelihood), purity, beliefs)


def with_answers(logs: Floats, answers: Iterable[AdviceRecord]) -> Floats:
    """Beliefs after some answers.

    An answer counts the less, the more the demonstrations of its states speak against it.

    Args:
        logs: (n, n_actions) log probability that an action is right, from the demonstrations.
        answers: in any order.

    Returns:
        (n, n_actions) log probabilities, up to a constant a state.
    """
    updated = logs.copy()
    for answer in answers:
        states = list(answer.states)
        updated[states] += np.log(_likelihood(common(shares(logs[states])), answer))
    return updated


def _likelihood(expected: Common, answer: AdviceRecord) -> Floats:
    """(n_actions,) probability of each action to be right in a state of the answer."""
    n_actions, preferred = len(expected.chance), list(answer.preferred)
    chance = float(expected.chance[preferred].sum())
    right = (1.0 - WRONG) * chance
    trust = right / (right + WRONG / (n_actions - 1) * (1.0 - chance))
    # What is neither preferred nor avoided is right in some of the states; where all else is avoided, nothing may be.
    open_ones = [action for action in range(n_actions) if action not in answer.preferred + answer.avoided]
    m = len(answer.states)
    purity = min(float(expected.purity[preferred].max()), 1.0 - len(open_ones) / m if m > 1 else 1.0)
    right_ones = np.full(n_actions, NEVER / n_actions)
    others = open_ones or list(answer.avoided)
    right_ones[others] = max(1.0 - purity, NEVER / n_actions) / max(len(others), 1)
    right_ones[preferred] = max(purity, NEVER) / len(preferred)
    said: Floats = trust * right_ones / right_ones.sum() + (1.0 - trust) / n_actions
    return said
