"""What the answers say together about each state, and which of them cannot both hold."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import combinations

from advise_ros.core.advice.advice import AdviceRecord, Preference, Verdict, active

Opposition = Callable[[AdviceRecord, AdviceRecord], bool]


def advice_in(log: tuple[AdviceRecord, ...]) -> tuple[AdviceRecord, ...]:
    """The records that hold and prefer something: no skips, no retractions."""
    return tuple(record for record in active(log) if record.verdict is Verdict.ANSWER)


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


def among(records: tuple[AdviceRecord, ...], against_each_other: Opposition = opposed) -> tuple[int, ...]:
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
