"""What an answer is worth: the expected visits of the policy that it corrects.

Any set of states can be asked about, also part of one that was asked about before. What the answer will be and in
which of the states it will be right is predicted from the demonstrations (`core/advice/error_model.py`) and the answers so far: a
state shares the common right action of a set with a probability, its purity, that the demonstrations speak for. Where
the policy does already what the answer will say, nothing is gained; where a set is mixed, little.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from advise_ros.core.advice.answer_beliefs import common, with_answers
from advise_ros.core.advice.error_model import log_beliefs, shares
from advise_ros.core.advice.state import AdviceState, Imitated
from advise_ros.core.numerics import Floats, Ints, first_best

# Share of the weight that is spread evenly: where the policy goes changes with the answers.
ANYWHERE = 0.3


def askable(partitions: Sequence[Ints]) -> list[Ints]:
    """States of each set that may be asked about: the clusters of the partitions (n,), and each state alone."""
    acting = np.flatnonzero(partitions[0] >= 0)
    parts = [np.flatnonzero(labels == label) for labels in partitions for label in range(labels.max() + 1)]
    single = [np.array([state]) for state in acting]
    return list({part.tobytes(): part for part in (*parts, *single)}.values())


class Worth(NamedTuple):
    """What each set of states is worth asking about.

    Attributes:
        sets: ascending states of each.
        gain: (sets,) share of the policy's visits that the answer is expected to correct; 0 once the set was asked about.
    """

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
        greedy: (n,) the policy's actions.
        occupancy: (n,) discounted visits that the policy is expected to pay.
        advice: everything that was answered.
        imitated: what is imitated, and the answers that take its place.
    """

    taken: Ints
    greedy: Ints
    occupancy: Floats
    advice: AdviceState
    imitated: Imitated


def worth(partitions: Sequence[Ints], known: Known) -> Worth:
    """What each question is worth.

    Args:
        partitions: clusters (n,), -1 where nobody acts.
        known: demonstrations, policy and answers.
    """
    acting, sets = partitions[0] >= 0, askable(partitions)
    logs = with_answers(log_beliefs(known.taken), known.advice.followed)
    visits = np.where(acting, known.occupancy, 0.0)
    visits = (1.0 - ANYWHERE) * visits / max(visits.sum(), np.finfo(float).tiny) + ANYWHERE * acting / acting.sum()
    asked = {record.states for record in known.advice.active}
    gains = _gains(sets, logs, _standing(known), visits)
    return Worth(sets, np.where([tuple(states.tolist()) in asked for states in sets], 0.0, gains))


def _standing(known: Known) -> Ints:
    """(n,) action that was advised or demonstrated in each state, and the policy's elsewhere."""
    favourite = known.imitated.favourite
    current = np.where(favourite >= 0, favourite, known.greedy)
    for state, preference in known.imitated.preferences.items():
        current[state] = preference.preferred[0]
    return current


def _gains(sets: Sequence[Ints], logs: Floats, current: Ints, visits: Floats) -> Floats:
    beliefs = shares(logs)
    # An answer about a single state holds for it.
    alone = visits * (1.0 - beliefs[np.arange(len(beliefs)), current])
    return np.array([
        alone[states[0]] if len(states) == 1 else common(beliefs[states]).gain(current[states], visits[states])
        for states in sets
    ])
