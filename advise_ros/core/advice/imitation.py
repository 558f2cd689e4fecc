"""What the program learns from: the demonstrated action of each state, and the answers beside it.

Algorithm 1 imitates the most frequent action, also where a person makes the same mistake again and again, and puts an
answer in its place in every state that was asked about. With the acquisition 'belief' it imitates the action that is
most likely the right one by all moves and all answers together (`error_model.py`, `answer_beliefs.py`): an answer about many
states is then strong evidence about each of them, not the last word on every one. Where the moves do not leave it beyond
doubt that the person makes mistakes it imitates the most frequent action after all.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.advice.answer_beliefs import BELIEF, BY_WORTH, heard
from advise_ros.core.advice.confirmation import narrowed
from advise_ros.core.advice.error_model import log_beliefs, mistakes_shown, shares
from advise_ros.core.demonstrations.action_counts import Counts
from advise_ros.core.numerics import Bools, Floats, Ints

# An answer about several states is not followed in one whose right action is another one with this probability.
REFUTED = 0.9


class Imitated(NamedTuple):
    """What the program learns from.

    Attributes:
        favourite: (n,) the action that is imitated in each state, -1 where none is.
        advice: the answers that stand in its place, in the states where they do.
    """

    favourite: Ints
    advice: tuple[AdviceRecord, ...]


def imitated(acquisition: str, counts: Counts, held: tuple[AdviceRecord, ...]) -> Imitated:
    """What is imitated and what is advised.

    Args:
        acquisition: that decides, from `gain.in_effect`.
        counts: what was demonstrated.
        held: the answers that hold.
    """
    advice = narrowed(held) if acquisition in BY_WORTH else held
    if acquisition == BELIEF and mistakes_shown(counts.taken):
        return _believed(counts, held, advice)
    return Imitated(counts.favourite(), advice)


def _believed(counts: Counts, held: tuple[AdviceRecord, ...], advice: tuple[AdviceRecord, ...]) -> Imitated:
    beliefs = shares(heard(log_beliefs(counts.taken), held))
    favourite = np.where(counts.visits > 0, beliefs.argmax(axis=1), -1)
    alone = {one.states[0] for one in held if len(one.states) == 1}
    return Imitated(favourite, tuple(left for one in advice if (left := _left(one, beliefs, favourite, alone)).states))


def _left(answer: AdviceRecord, beliefs: Floats, favourite: Ints, alone: set[int]) -> AdviceRecord:
    """The answer in the states where it says what is not imitated anyhow, and where nothing refutes it."""
    states = np.array(answer.states)
    agrees = np.isin(favourite[states], answer.preferred)
    together = np.array([state not in alone for state in answer.states])
    refuted: Bools = together & (favourite[states] >= 0) & (beliefs[states].max(axis=1) >= REFUTED)
    return replace(answer, states=tuple(states[~(agrees | refuted)].tolist()))
