"""What an answer is worth: how many of the policy's visits it is expected to put right.

Any set of states can be asked about, also part of one that was asked about before. What the answer will be and in
which of the states it will be right is predicted from the demonstrations (`core/belief.py`) and the answers so far: a
state shares the common right action of a set with a probability, its purity, that the demonstrations speak for. Where
the policy does already what the answer will say, nothing is gained; where a set is mixed, little.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from advise_ros.core.advice import AdviceRecord, active
from advise_ros.core.belief import log_beliefs, shares
from advise_ros.core.contradictions import preferences
from advise_ros.core.numerics import Floats, Ints, first_best

# The names of this way to ask among the acquisitions; 'belief' also imitates what is believed (`core/imitation.py`).
GAIN, BELIEF = 'gain', 'belief'
BY_WORTH = (GAIN, BELIEF)
# Beliefs take so many moves a state, on average; with fewer, questions go where the policy does.
MOVES = 5.0
WITHOUT_BELIEFS = 'occupancy'
# A set is expected to be this pure before its demonstrations are looked at, which counts as so many states.
PURITY, PURITY_STATES = 0.85, 2
PURITY_ROUNDS = 5
ALONE = 1.0 - 1e-6
# An expert is wrong so often ...
WRONG = 0.05
# ... and calls an action wrong everywhere that is right somewhere with this probability.
NEVER = 0.01
# So much of the weight is spread evenly: where the policy goes changes with the answers.
ANYWHERE = 0.3


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
        """Visits that the answer is expected to put right, when the policy's actions (m,) are paid so many (m,)."""
        rest = (1.0 - self.purity) / self.beliefs.shape[1]
        # (m, n_actions) of each answer: what it prefers, and what is done now, once it is known.
        preferred, total = self.beliefs * (self.purity + rest), self.beliefs * self.purity + rest
        now = self.beliefs[np.arange(len(current)), current][:, None] * rest
        better = np.maximum(preferred - now, 0.0) / total
        better[np.arange(len(current)), current] = 0.0
        return float(visits @ better @ self.chance)


def common(beliefs: Floats) -> Common:
    """What is expected of the states of a set, from their beliefs (m, n_actions)."""
    m, n_actions = beliefs.shape
    purity = np.full(n_actions, ALONE if m == 1 else PURITY)
    for _ in range(PURITY_ROUNDS if m > 1 else 0):
        shared = purity * beliefs
        sharing = (shared / (shared + (1.0 - purity) / n_actions)).sum(axis=0)
        purity = np.maximum((sharing + PURITY_STATES * PURITY) / (m + PURITY_STATES), 1.0 / m)
    likelihood = np.log(purity * beliefs + (1.0 - purity) / n_actions).sum(axis=0)
    return Common(shares(likelihood), purity, beliefs)


def heard(logs: Floats, answers: Iterable[AdviceRecord]) -> Floats:
    """(n, n_actions) log beliefs with what the answers say about the states that they cover.

    An answer that the demonstrations of its states speak against counts the less, the more they do.
    """
    told = logs.copy()
    for answer in answers:
        states = list(answer.states)
        told[states] += np.log(_said(common(shares(logs[states])), answer))
    return told


def _said(expected: Common, answer: AdviceRecord) -> Floats:
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


def askable(partitions: Sequence[Ints]) -> list[Ints]:
    """States of each set that may be asked about: the clusters of the partitions (n,), and each state alone."""
    acting = np.flatnonzero(partitions[0] >= 0)
    parts = [np.flatnonzero(labels == label) for labels in partitions for label in range(labels.max() + 1)]
    single = [np.array([state]) for state in acting]
    return list({part.tobytes(): part for part in (*parts, *single)}.values())


def in_effect(acquisition: str, visits: Ints) -> str:
    """The acquisition that decides, where the states in which one acts have been visited so often (m,)."""
    few = visits.sum() < MOVES * len(visits)
    return WITHOUT_BELIEFS if acquisition in BY_WORTH and few else acquisition


class Worth(NamedTuple):
    """What each set of states is worth asking about: the share of the policy's visits put right; 0 once it was asked."""

    sets: list[Ints]
    gain: Floats

    @property
    def most(self) -> float:
        """Of the best question that is left."""
        return float(self.gain.max(initial=0.0))

    def best(self) -> Ints | None:
        """States of the best question, ties to the first; None when nothing is to be gained."""
        if self.most <= 0.0:
            return None
        return self.sets[int(first_best(self.gain / self.most))]


class Known(NamedTuple):
    """What is known when a question is chosen.

    Attributes:
        taken: (n, n_actions) demonstrated actions.
        favourite: (n,) the actions that are imitated, -1 where none is.
        greedy: (n,) the policy's actions.
        occupancy: (n,) visits that it is expected to pay.
        log: everything that was said.
        held: the answers that hold.
        advice: in the states where they stand in the place of what is imitated.
    """

    taken: Ints
    favourite: Ints
    greedy: Ints
    occupancy: Floats
    log: tuple[AdviceRecord, ...]
    held: tuple[AdviceRecord, ...]
    advice: tuple[AdviceRecord, ...]


def worth(partitions: Sequence[Ints], known: Known) -> Worth:
    """What each question is worth.

    Args:
        partitions: clusters (n,), -1 where nobody acts.
        known: demonstrations, policy and answers.
    """
    acting, sets = partitions[0] >= 0, askable(partitions)
    logs = heard(log_beliefs(known.taken), known.held)
    visits = np.where(acting, known.occupancy, 0.0)
    visits = (1.0 - ANYWHERE) * visits / max(visits.sum(), np.finfo(float).tiny) + ANYWHERE * acting / acting.sum()
    asked = {record.states for record in active(known.log)}
    gains = _gains(sets, logs, _standing(known), visits)
    return Worth(sets, np.where([tuple(states.tolist()) in asked for states in sets], 0.0, gains))


def _standing(known: Known) -> Ints:
    """(n,) what is to be done as far as anyone said or showed it, and what the policy does elsewhere."""
    current = np.where(known.favourite >= 0, known.favourite, known.greedy)
    for state, preference in preferences(known.advice).items():
        current[state] = preference.preferred[0]
    return current


def _gains(sets: Sequence[Ints], logs: Floats, current: Ints, visits: Floats) -> Floats:
    beliefs = shares(logs)
    # Who is asked about one state alone answers for it.
    alone = visits * (1.0 - beliefs[np.arange(len(beliefs)), current])
    return np.array([
        alone[states[0]] if len(states) == 1 else common(beliefs[states]).gain(current[states], visits[states])
        for states in sets
    ])
