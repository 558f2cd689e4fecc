"""Queries, answers and the records of accepted answers: the values of the advice loop."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple


class Verdict(IntEnum):
    """What kind of answer it is; as advise_msgs/srv/AnswerQuery."""

    ANSWER = 0
    SKIP = 1
    UNSURE = 2
    MIXED = 3
    SPLIT = 4


class Code(IntEnum):
    """Why an answer was taken or refused; as advise_msgs/srv/AnswerQuery."""

    OK = 0
    UNKNOWN_QUERY = 1
    STALE_QUERY = 2
    ALREADY_ANSWERED = 3
    INVALID_ACTION = 4
    OVERLAPPING_SETS = 5
    EMPTY_SETS = 6
    CONTRADICTION = 7
    BUDGET_SPENT = 8
    INVALID_VERDICT = 9
    NOT_SAVED = 10
    INVALID_PART = 11


@dataclass(frozen=True)
class Query:
    """A question about a cluster of states.

    Attributes:
        query_id: counts up from 1 within a session.
        policy_version: the policy that it was asked under.
        states: (m,) ascending.
        uncertainty: U_c of the cluster [nat].
        demonstration_uncertainty, policy_uncertainty: mean F and mean G over the cluster [nat].
        demonstrated, policy: (n_actions,) mean action distributions over the cluster.
        answered_before: states of the cluster that have advice already, ascending.
        budget_left: answers left, -1 unlimited.
        question: one plain sentence.
        disagreement, scarcity: the two sources of F, means over the cluster [nat].
    """

    query_id: int
    policy_version: int
    states: tuple[int, ...]
    uncertainty: float
    demonstration_uncertainty: float
    policy_uncertainty: float
    demonstrated: tuple[float, ...]
    policy: tuple[float, ...]
    answered_before: tuple[int, ...]
    budget_left: int
    question: str
    disagreement: float = 0.0
    scarcity: float = 0.0


@dataclass(frozen=True)
class Answer:
    """What a person said to a query, before any check; `part` is one side of a SPLIT."""

    query_id: int
    verdict: int
    preferred: tuple[int, ...] = ()
    avoided: tuple[int, ...] = ()
    expert_id: str = ''
    comment: str = ''
    part: tuple[int, ...] = ()


@dataclass(frozen=True)
class AdviceRecord:
    """One entry of the session's log: an accepted answer, or its retraction.

    A retraction is the same record again with `retracted` true, appended: the log only grows.
    The states of a SPLIT are the drawn part, those of all others the whole query.
    """

    advice_id: int
    query_id: int
    states: tuple[int, ...]
    preferred: tuple[int, ...]
    avoided: tuple[int, ...]
    verdict: Verdict
    expert_id: str = ''
    comment: str = ''
    retracted: bool = False


@dataclass(frozen=True)
class Outcome:
    """The reply to an answer, an undo or a retraction: a value, never an exception.

    Attributes:
        record: what was appended to the log, None when refused.
        contradicts: advice ids of earlier answers that disagree with this one.
    """

    accepted: bool
    code: Code
    message: str
    record: AdviceRecord | None = None
    contradicts: tuple[int, ...] = ()
    budget_left: int = -1


def active(log: tuple[AdviceRecord, ...]) -> tuple[AdviceRecord, ...]:
    """The records that hold: neither retractions nor what they took back, in order."""
    retracted = {record.advice_id for record in log if record.retracted}
    return tuple(record for record in log if record.advice_id not in retracted)


class Preference(NamedTuple):
    """What the advice says about one state, all answers together.

    Attributes:
        preferred: ascending actions.
        pairs: ascending (preferred, avoided) actions.
    """

    preferred: tuple[int, ...]
    pairs: tuple[tuple[int, int], ...]
