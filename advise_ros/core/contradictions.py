"""What the answers say together about each state, and which of them cannot both hold."""

from __future__ import annotations

from collections.abc import Iterable

from advise_ros.core.advice import AdviceRecord, Verdict, active
from advise_ros.core.program import Preference


def advice_in(log: tuple[AdviceRecord, ...]) -> tuple[AdviceRecord, ...]:
    """The records that hold and prefer something: no skips, no retractions."""
    return tuple(record for record in active(log) if record.verdict is Verdict.ANSWER)


def preferences(records: Iterable[AdviceRecord]) -> dict[int, Preference]:
    """What the records say about each state that they cover, in any order of the records."""
    said = tuple(records)
    covering: dict[int, list[int]] = {}
    for number, record in enumerate(said):
        for state in record.states:
            covering.setdefault(state, []).append(number)
    together: dict[tuple[int, ...], Preference] = {}  # Many states, few different sets of records.
    for numbers in map(tuple, covering.values()):
        if numbers not in together:
            together[numbers] = _together([said[number] for number in numbers])
    return {state: together[tuple(covering[state])] for state in sorted(covering)}


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


def among(records: tuple[AdviceRecord, ...], slack_states: Iterable[int]) -> tuple[int, ...]:
    """Advice ids that contradict one another, ascending.

    Args:
        records: the advice that holds.
        slack_states: states whose advice no reward satisfies together with the rest.
    """
    found: set[int] = set()
    for record in records:
        partners = against(record, records)
        if partners:
            found |= {record.advice_id, *partners}
    for state in slack_states:
        covering = [record for record in records if state in record.states]
        if not any(opposed(a, b) for a in covering for b in covering):
            found |= {record.advice_id for record in covering}
    return tuple(sorted(found))
