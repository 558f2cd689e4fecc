"""Values of the learner <-> messages. The messages are pure functions of the values and a stamp.

Replay rebuilds a session's messages with these same functions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from advise_msgs import msg, srv
from advise_ros.core.advice.advice import AdviceRecord, Answer, AnswerOption, Meaning, Outcome, Query, Verdict
from advise_ros.core.grid.grid import Action, Grid
from advise_ros.core.units import MAP_FRAME
from advise_ros.ros.convert import grid_to_msg, stamp_from_ns

if TYPE_CHECKING:  # The learner's solvers take seconds to import, and commands need none of them.
    from advise_ros.core.learning.learner import Learned

ACTION_NAMES = tuple(action.name for action in Action)


def policy_to_msg(learned: Learned, stamp_ns: int) -> msg.Policy:
    out = msg.Policy()
    out.header.frame_id, out.header.stamp = MAP_FRAME, stamp_from_ns(stamp_ns)
    out.version = learned.version
    out.grid = grid_to_msg(learned.grid)
    out.demonstrations, out.log_length = learned.n_demonstrations, learned.log_length
    out.greedy = np.asarray(learned.greedy, dtype=np.uint8).tolist()
    out.probabilities = _float32(learned.probabilities)
    out.reward, out.value = _float32(learned.reward), _float32(learned.value)
    out.digest = learned.digest
    return out


def query_to_msg(query: Query, grid: Grid, stamp_ns: int) -> msg.AdviceQuery:
    out = _query_frame(grid, query.policy_version, stamp_ns)
    out.query_id = query.query_id
    out.states = list(query.states)
    out.uncertainty = float(np.float32(query.uncertainty))
    out.demonstration_uncertainty = float(np.float32(query.demonstration_uncertainty))
    out.policy_uncertainty = float(np.float32(query.policy_uncertainty))
    out.disagreement = float(np.float32(query.disagreement))
    out.scarcity = float(np.float32(query.scarcity))
    out.demonstrated, out.policy = _float32(query.demonstrated), _float32(query.policy)
    out.answered_before = list(query.answered_before)
    out.budget_left = query.budget_left
    out.question = query.question
    out.disputed, out.worth = list(query.disputed), float(np.float32(query.worth))
    out.options = [_option_to_msg(option) for option in query.options]
    return out


def _option_to_msg(option: AnswerOption) -> msg.AnswerOption:
    return msg.AnswerOption(
        meaning=int(option.meaning), word=option.word, label=option.label,
        preferred=list(option.preferred), avoided=list(option.avoided), route=list(option.route),
    )


def _option_from_msg(option: msg.AnswerOption) -> AnswerOption:
    return AnswerOption(
        Meaning(option.meaning), option.word, option.label, *(
            tuple(int(number) for number in numbers) for numbers in (option.preferred, option.avoided, option.route)
        ),
    )


def no_query_to_msg(learned: Learned, budget_left: int, stamp_ns: int) -> msg.AdviceQuery:
    """The message that says there is no question left: query id 0, no states."""
    out = _query_frame(learned.grid, learned.version, stamp_ns)
    out.demonstrated = out.policy = [0.0] * len(ACTION_NAMES)
    out.budget_left = budget_left
    out.question = nothing_to_ask(learned, budget_left)
    return out


def nothing_to_ask(learned: Learned | None, budget_left: int) -> str:
    """Why no question is open, in a sentence or two.

    Args:
        learned: the newest result; None: nothing was learnt yet.
        budget_left: answers, -1 unlimited.
    """
    if learned is not None and learned.enough_advice:
        least = f'{learned.least_worth:g} {learned.worth_unit}'
        return f'I would fly it now: no question is worth an answer any more (each less than {least}).'
    return 'The budget of answers is spent.' if budget_left == 0 else 'There is nothing left to ask.'


def _query_frame(grid: Grid, policy_version: int, stamp_ns: int) -> msg.AdviceQuery:
    out = msg.AdviceQuery()
    out.header.frame_id, out.header.stamp = MAP_FRAME, stamp_from_ns(stamp_ns)
    out.policy_version = policy_version
    out.grid = grid_to_msg(grid)
    out.action_names = list(ACTION_NAMES)
    return out


def query_from_msg(query: msg.AdviceQuery) -> Query | None:
    """The query of a message, None for the one that says there is none."""
    if query.query_id == 0:
        return None
    return Query(
        query_id=int(query.query_id), policy_version=int(query.policy_version),
        states=tuple(int(state) for state in query.states),
        uncertainty=float(query.uncertainty),
        demonstration_uncertainty=float(query.demonstration_uncertainty),
        policy_uncertainty=float(query.policy_uncertainty),
        demonstrated=tuple(float(share) for share in query.demonstrated),
        policy=tuple(float(share) for share in query.policy),
        answered_before=tuple(int(state) for state in query.answered_before),
        budget_left=int(query.budget_left), question=query.question,
        disagreement=float(query.disagreement), scarcity=float(query.scarcity),
        disputed=tuple(int(cell) for cell in query.disputed), worth=float(query.worth),
        options=tuple(_option_from_msg(option) for option in query.options),
    )


def advice_to_msg(record: AdviceRecord, stamp_ns: int) -> msg.Advice:
    out = msg.Advice()
    out.header.frame_id, out.header.stamp = MAP_FRAME, stamp_from_ns(stamp_ns)
    out.advice_id, out.query_id = record.advice_id, record.query_id
    out.states = list(record.states)
    out.preferred, out.avoided = list(record.preferred), list(record.avoided)
    out.verdict = int(record.verdict)
    out.expert_id, out.comment, out.retracted = record.expert_id, record.comment, record.retracted
    return out


def advice_from_msg(advice: msg.Advice) -> AdviceRecord:
    return AdviceRecord(
        advice_id=int(advice.advice_id), query_id=int(advice.query_id),
        states=tuple(int(state) for state in advice.states),
        preferred=tuple(int(action) for action in advice.preferred),
        avoided=tuple(int(action) for action in advice.avoided),
        verdict=Verdict(advice.verdict), expert_id=advice.expert_id, comment=advice.comment,
        retracted=bool(advice.retracted),
    )


def answer_from_request(request: srv.AnswerQuery.Request | srv.PreviewAnswer.Request) -> Answer:
    """The answer of a request, unchecked; a preview names no expert."""
    return Answer(
        query_id=int(request.query_id), verdict=int(request.verdict),
        preferred=tuple(int(action) for action in request.preferred),
        avoided=tuple(int(action) for action in request.avoided),
        expert_id=getattr(request, 'expert_id', ''), comment=getattr(request, 'comment', ''),
        part=tuple(int(state) for state in request.part),
    )


def answer_to_request(answer: Answer) -> srv.AnswerQuery.Request:
    return srv.AnswerQuery.Request(
        query_id=answer.query_id, verdict=answer.verdict,
        preferred=list(answer.preferred), avoided=list(answer.avoided), part=list(answer.part),
        expert_id=answer.expert_id, comment=answer.comment,
    )


def fill_answer(response: srv.AnswerQuery.Response, outcome: Outcome) -> srv.AnswerQuery.Response:
    response.accepted, response.code, response.message = outcome.accepted, int(outcome.code), outcome.message
    response.contradicts = list(outcome.contradicts)
    response.advice_id = outcome.record.advice_id if outcome.record else 0
    response.budget_left = outcome.budget_left
    return response


def _float32(values: Any) -> list[float]:
    """Flat, row-major, each rounded to float32 as it travels."""
    return np.asarray(values, dtype=np.float32).ravel().tolist()
