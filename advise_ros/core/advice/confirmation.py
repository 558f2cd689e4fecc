"""Answers that the demonstrations do not bear out are asked for again, and what was said more often holds.

Who flies badly still makes the right move now and then, also where he makes the same mistake again and again. An answer
that prefers what was hardly ever flown in a whole cluster is therefore more likely a slip than the truth.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import groupby

from scipy.special import bdtr

from advise_ros.core.advice.advice import AdviceRecord, Verdict, active
from advise_ros.core.numerics import Ints

# Of the moves in a cluster at least this share are the right ones, whatever mistakes are made there ...
RIGHT = 0.15
# ... so an answer is doubtful when that would lead to so few moves as were seen with this probability at most.
CHANCE = 0.02

_Said = tuple[tuple[int, ...], tuple[int, ...]]


def support(taken: Ints, record: AdviceRecord) -> tuple[int, int]:
    """Moves that the answer prefers, and all moves, in its states."""
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


def unconfirmed(log: tuple[AdviceRecord, ...], taken: Ints) -> AdviceRecord | None:
    """A doubtful answer to a question that was asked but once; the one with the lowest states."""
    alone = (records[0] for _, records in _by_states(active(log)) if len(records) == 1)
    return next((one for one in alone if one.verdict is Verdict.ANSWER and doubtful(taken, one)), None)


def agreed(answers: Iterable[AdviceRecord], taken: Ints) -> tuple[AdviceRecord, ...]:
    """Of answers about the very same states, those that say what was said most often, in their order.

    Of what was said equally often holds what the demonstrations bear out most.
    """
    said = tuple(answers)
    held = {one.advice_id for _, records in _by_states(said) for one in _prevailing(records, taken)}
    return tuple(one for one in said if one.advice_id in held)


def narrowed(answers: Iterable[AdviceRecord]) -> tuple[AdviceRecord, ...]:
    """Each answer in the states where it is the most particular one: that about fewer states prevails.

    Of answers about equally many states all hold.
    """
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
