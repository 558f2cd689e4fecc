"""What can be wrong with an answer whatever was asked: its verdict and its two sets."""

from __future__ import annotations

from typing import NamedTuple

from advise_ros.core.advice.advice import AdviceRecord, Answer, Code, Query, Verdict
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import N_ACTIONS, Action, Grid


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
