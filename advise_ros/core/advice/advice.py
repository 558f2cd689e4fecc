"""Queries, answers and the records of accepted answers: the values of the advice loop, and what can be wrong with them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import N_ACTIONS, Action, Grid


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


class Meaning(IntEnum):
    """What an answer of one gesture says of the cells in dispute; as advise_msgs/msg/AnswerOption."""

    KEEP_OUT = 0
    FLY_THROUGH = 1


class AnswerOption(NamedTuple):
    """An answer that one gesture gives.

    Attributes:
        word: for commands, e.g. 'on-purpose'.
        label: for a button, e.g. 'On purpose: keep out'.
        preferred, avoided: the answer that it stands for, about all states of the query.
        route: states that the drone is expected to fly after it.
    """

    meaning: Meaning
    word: str
    label: str
    preferred: tuple[int, ...]
    avoided: tuple[int, ...]
    route: tuple[int, ...] = ()


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
        disputed: cells that the answer decides to keep out of or not, ascending; empty unless it is about a site.
        options: answers of one gesture, in the order of their meaning; empty where there are none.
        worth: steps that the answer is expected to save; 0 unless it is about a site.
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
    disputed: tuple[int, ...] = ()
    options: tuple[AnswerOption, ...] = ()
    worth: float = 0.0


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


class Fault(NamedTuple):
    """Why an answer is refused."""

    code: Code
    message: str


def fault(answer: Answer) -> Fault | None:
    """What is wrong with the verdict or the sets, None when nothing is; only ANSWER needs sets."""
    if answer.verdict not in tuple(Verdict):
        allowed = ', '.join(f'{verdict.value} {verdict.name}' for verdict in Verdict)
        return Fault(Code.INVALID_VERDICT, f'verdict {answer.verdict} is unknown; allowed: {allowed}')
    if answer.verdict != Verdict.ANSWER:
        return None
    for actions in (answer.preferred, answer.avoided):
        if not valid_actions(actions):
            allowed = ', '.join(f'{action.value} {action.name}' for action in Action)
            return Fault(Code.INVALID_ACTION, f'{list(actions)} must name each action once, out of {allowed}')
    if not answer.preferred or not answer.avoided:
        empty = 'avoided' if answer.preferred else 'preferred'
        return Fault(Code.EMPTY_SETS, f'no action is {empty}; name at least one, or skip the question')
    both = sorted(set(answer.preferred) & set(answer.avoided))
    if both:
        names = ' and '.join(Action(action).name for action in both)
        return Fault(Code.OVERLAPPING_SETS, f'{names} preferred and avoided at once; choose one side')
    return None


def part_fault(answer: Answer, query: Query) -> Fault | None:
    """What is wrong with the part of a SPLIT, None when nothing is."""
    if answer.verdict != Verdict.SPLIT:
        return None
    part = set(answer.part)
    if part and part < set(query.states) and len(part) == len(answer.part):
        return None
    return Fault(Code.INVALID_PART, f"a split must name some, not all, of the query's {len(query.states)} states, each once")


def valid_actions(actions: tuple[int, ...]) -> bool:
    """Whether each is an action and none stands twice."""
    return len(set(actions)) == len(actions) and all(0 <= action < N_ACTIONS for action in actions)


def check_log(grid: Grid, log: tuple[AdviceRecord, ...]) -> None:
    """Whether a log fits a grid.

    Raises:
        InputError: a record's state or action does not exist.
    """
    for record in log:
        if any(not 0 <= state < grid.n_states for state in record.states):
            raise InputError(
                f'answer {record.advice_id} of the restored log names a state outside 0 to {grid.n_states - 1}; '
                'it belongs to another grid'
            )
        if not (valid_actions(record.preferred) and valid_actions(record.avoided)):
            raise InputError(
                f'answer {record.advice_id} of the restored log names an action twice or outside 0 to {N_ACTIONS - 1}'
            )
