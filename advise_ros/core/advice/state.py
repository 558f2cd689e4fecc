"""What the log of answers says, computed once a change and passed down; and what is imitated because of it.

Answers about one state can contradict each other. Answers that the demonstrations do not bear out are asked for again, and
what was said more often is followed: a clumsy pilot still makes the right move now and then, also where he makes the same
mistake again and again, so an answer that prefers what was hardly ever flown in a whole cluster is more likely a slip.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, groupby

import numpy as np
from scipy.special import bdtr

from advise_ros.core.advice.advice import AdviceRecord, Preference, Verdict, active
from advise_ros.core.numerics import Bools, Ints

# Of the moves in a cluster at least this share are the right ones, whatever mistakes are made there ...
RIGHT = 0.15
# ... so an answer is doubtful when that would lead to so few moves as were seen with this probability at most.
CHANCE = 0.02

_Said = tuple[tuple[int, ...], tuple[int, ...]]
Opposition = Callable[[AdviceRecord, AdviceRecord], bool]


@dataclass(frozen=True, eq=False)
class AdviceState:
    """What the log says after its last entry.

    Attributes:
        log: every accepted answer and retraction, in order.
        active: records that hold, in order: neither retractions nor what they took back.
        answers: those of them that prefer something.
        followed: the answers that are learnt from; of answers about the very same states, those that were given most often.
        doubtful: an answer that the demonstrations make unlikely and whose question was asked once only: it is asked again.
    """

    log: tuple[AdviceRecord, ...]
    active: tuple[AdviceRecord, ...]
    answers: tuple[AdviceRecord, ...]
    followed: tuple[AdviceRecord, ...]
    doubtful: AdviceRecord | None

    def budget_left(self, budget: int) -> int:
        """Answers left of a budget, -1 unlimited; skipping costs nothing, and what is taken back is given back."""
        return -1 if budget < 0 else max(0, budget - len(self.answers))

    @cached_property
    def mixed(self) -> tuple[tuple[int, ...], ...]:
        """Sets of states that need different actions, as the person said."""
        return tuple(record.states for record in self.active if record.verdict is Verdict.MIXED)

    @cached_property
    def drawn(self) -> tuple[tuple[int, ...], ...]:
        """Sets of states that the person cut off a cluster."""
        return tuple(record.states for record in self.active if record.verdict is Verdict.SPLIT)

    @cached_property
    def advised(self) -> frozenset[int]:
        """States that an answer speaks about."""
        return frozenset(state for record in self.answers for state in record.states)

    def asked(self, n_states: int) -> Bools:
        """(n_states,) whether a question about the state is done with; not where the person wants it asked in parts."""
        asked = np.zeros(n_states, dtype=np.bool_)
        for record in self.active:
            in_parts = record.verdict is Verdict.SPLIT or (record.verdict is Verdict.MIXED and len(record.states) > 1)
            if not in_parts:
                asked[list(record.states)] = True
        return asked


def advice_state(log: tuple[AdviceRecord, ...], taken: Ints | None = None) -> AdviceState:
    """What a log says.

    Args:
        log: accepted answers and retractions, in order.
        taken: (n, n_actions) demonstrated moves, if unlikely answers are to be confirmed; None: every answer is followed.
    """
    holding = active(log)
    answers = tuple(record for record in holding if record.verdict is Verdict.ANSWER)
    if taken is None:
        return AdviceState(log, holding, answers, answers, None)
    return AdviceState(log, holding, answers, agreed(answers, taken), unconfirmed(holding, taken))


@dataclass(frozen=True, eq=False)
class Imitated:
    """What the program learns from.

    Attributes:
        favourite: (n,) the action that is imitated in each state, -1 where none is.
        advice: the answers that take its place, in the states where they do.
    """

    favourite: Ints
    advice: tuple[AdviceRecord, ...]

    @cached_property
    def preferences(self) -> Mapping[int, Preference]:
        """What the advice says about each state that it covers."""
        return preferences(self.advice)


# -- what answers say about each state ----------------------------------------------------------------
def preferences(records: Iterable[AdviceRecord]) -> dict[int, Preference]:
    """What the records say about each state that they cover, in any order of the records."""
    said = tuple(records)
    covering = _covering(said)
    # Many states, few different sets of records.
    together = {numbers: _together([said[number] for number in numbers]) for numbers in set(covering.values())}
    return {state: together[covering[state]] for state in sorted(covering)}


def _together(records: list[AdviceRecord]) -> Preference:
    preferred = {action for record in records for action in record.preferred}
    pairs = {(a, b) for record in records for a in record.preferred for b in record.avoided}
    return Preference(tuple(sorted(preferred)), tuple(sorted(pairs)))


def opposed(one: AdviceRecord, other: AdviceRecord) -> bool:
    """Whether one prefers an action that the other avoids."""
    return bool(set(one.preferred) & set(other.avoided) or set(one.avoided) & set(other.preferred))


def against(answer: AdviceRecord, records: Iterable[AdviceRecord]) -> tuple[int, ...]:
    """Advice ids of the records that share a state with the answer and oppose it, ascending."""
    asked = set(answer.states)
    return tuple(sorted(r.advice_id for r in records if opposed(answer, r) and not asked.isdisjoint(r.states)))


def reversed_pair(one: AdviceRecord, other: AdviceRecord) -> bool:
    """Whether one prefers an action to another and the other one the reverse, which no reward satisfies."""
    return bool(set(one.preferred) & set(other.avoided) and set(one.avoided) & set(other.preferred))


def contradicting(records: tuple[AdviceRecord, ...], against_each_other: Opposition = opposed) -> tuple[int, ...]:
    """Advice ids of all records that another one opposes in a state that they share, ascending."""
    found: set[int] = set()
    for numbers in set(_covering(records).values()):
        for one, other in combinations((records[number] for number in numbers), 2):
            if against_each_other(one, other):
                found |= {one.advice_id, other.advice_id}
    return tuple(sorted(found))


def _covering(records: tuple[AdviceRecord, ...]) -> dict[int, tuple[int, ...]]:
    """Which records, by number and ascending, speak about each state."""
    covering: dict[int, list[int]] = {}
    for number, record in enumerate(records):
        for state in record.states:
            covering.setdefault(state, []).append(number)
    return {state: tuple(numbers) for state, numbers in covering.items()}


# -- which answers are doubtful, and which are followed ------------------------------------------------
def support(taken: Ints, record: AdviceRecord) -> tuple[int, int]:
    """How many moves bear an answer out.

    Args:
        taken: (n, n_actions) how often each action was taken in each state.
        record: the answer.

    Returns:
        Moves in its states that it prefers, and all moves there.
    """
    moves = taken[list(record.states)]
    return int(moves[:, list(record.preferred)].sum()), int(moves.sum())


def doubtful(taken: Ints, record: AdviceRecord) -> bool:
    """Whether the demonstrations make the answer unlikely.

    Args:
        taken: (n, n_actions) demonstrated actions.
        record: an answer.
    """
    preferred, moves = support(taken, record)
    return bool(moves > 0 and bdtr(preferred, moves, RIGHT) < CHANCE)


def unconfirmed(active: Iterable[AdviceRecord], taken: Ints) -> AdviceRecord | None:
    """A doubtful answer to a question that was asked once only; the one with the lowest states.

    Args:
        active: the records that hold.
        taken: (n, n_actions) demonstrated actions.
    """
    alone = (records[0] for _, records in _by_states(active) if len(records) == 1)
    return next((record for record in alone if record.verdict is Verdict.ANSWER and doubtful(taken, record)), None)


def agreed(answers: Iterable[AdviceRecord], taken: Ints) -> tuple[AdviceRecord, ...]:
    """Of answers about the very same states, the most frequent one, in their order; of equally frequent ones, the most flown.

    Args:
        answers: that prefer something.
        taken: (n, n_actions) demonstrated actions.
    """
    given = tuple(answers)
    followed = {record.advice_id for _, records in _by_states(given) for record in _prevailing(records, taken)}
    return tuple(record for record in given if record.advice_id in followed)


def narrowed(answers: Iterable[AdviceRecord]) -> tuple[AdviceRecord, ...]:
    """Each answer in the states where none is about fewer states; of answers about equally many states all hold."""
    said = tuple(answers)
    fewest: dict[int, int] = {}
    for one in said:
        for state in one.states:
            fewest[state] = min(len(one.states), fewest.get(state, len(one.states)))
    left = (replace(one, states=tuple(s for s in one.states if fewest[s] == len(one.states))) for one in said)
    return tuple(one for one in left if one.states)


def _prevailing(records: list[AdviceRecord], taken: Ints) -> list[AdviceRecord]:
    said = [_said(one) for one in records]
    best = max(records, key=lambda one: (said.count(_said(one)), support(taken, one)[0], _said(one)))
    return [one for one in records if _said(one) == _said(best)]


def _said(record: AdviceRecord) -> _Said:
    return tuple(sorted(record.preferred)), tuple(sorted(record.avoided))


def _by_states(records: Iterable[AdviceRecord]) -> list[tuple[tuple[int, ...], list[AdviceRecord]]]:
    """Records about the very same states, by these, ascending."""
    ordered = sorted(records, key=lambda one: (one.states, one.advice_id))
    return [(states, list(group)) for states, group in groupby(ordered, key=lambda one: one.states)]
