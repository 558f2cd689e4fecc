"""Ask, tell, undo: every wrong answer has its code, and what is taken back leaves no trace."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import pytest

from advise_ros.core.advice.advice import AdviceRecord, Answer, Code, Verdict
from advise_ros.core.errors import InputError
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.session import Session, Work
from support.learning import (
    BY_CLUSTERS,
    CORRIDOR,
    EAST,
    NORTH,
    ROUND_TRIP,
    SOUTH,
    WEST,
    answer,
    demonstration,
    flights,
    ready,
    record,
    taken_back,
)


def test_nothing_to_learn_before_the_first_demonstration() -> None:
    session = Session(ROUND_TRIP, BY_CLUSTERS)
    assert session.snapshot() is None
    assert session.query is None
    assert session.submit(Answer(1, Verdict.SKIP)).code == Code.UNKNOWN_QUERY


def test_a_demonstration_on_another_grid_is_refused_in_words() -> None:
    session = Session(ROUND_TRIP, BY_CLUSTERS)
    with pytest.raises(InputError, match=r"'test' lies on another grid \(resolution 1.0 m there and 2.0 m here, size 4 x 1"):
        session.add(demonstration(CORRIDOR, [(0, EAST)]))
    assert session.demonstrations == ()


def test_a_demonstration_taken_back_leaves_no_trace_but_in_the_count() -> None:
    first, second, third = flights(0, number=3)
    session, never = Session(ROUND_TRIP, BY_CLUSTERS), Session(ROUND_TRIP, BY_CLUSTERS)
    for found in (first, second):
        session.add(found)
        session.learn()
    session.add(taken_back(second))
    assert session.standing == (first,)
    never.add(first)
    without, alone = session.learn(), never.learn()
    assert (without.digest, without.reward.tobytes()) == (alone.digest, alone.reward.tobytes())
    assert (without.n_demonstrations, alone.n_demonstrations) == (3, 1)
    session.add(third)
    assert session.learn().n_demonstrations == 4


def test_when_nothing_stands_there_is_nothing_to_learn_until_the_next_flight() -> None:
    first, second = flights(0, number=2)
    session = Session(ROUND_TRIP, BY_CLUSTERS)
    session.add(first)
    learned = session.learn()
    session.add(taken_back(first))
    assert (session.standing, session.snapshot(), session.learned) == ((), None, learned)
    assert session.submit(answer(session)).accepted, 'what is said about states holds whatever was flown'
    session.add(second)
    assert session.learn().log_length == 1


def test_an_accepted_answer_closes_its_question_and_asks_for_learning() -> None:
    session = ready()
    asked = session.query
    outcome = session.submit(answer(session))
    assert (outcome.accepted, outcome.code) == (True, Code.OK)
    assert outcome.record is not None
    assert asked is not None
    assert (outcome.record.states, outcome.record.advice_id) == (asked.states, 1)
    assert session.query is None
    learned = session.learn()
    assert learned.query is not None
    assert (learned.version, learned.query.query_id) == (2, 2)
    assert not set(learned.query.states) & set(asked.states)


@pytest.mark.parametrize(
    ('given', 'code', 'words'),
    [
        ({'query_id': 99}, Code.UNKNOWN_QUERY, 'query 99 was never asked; query 1 is open'),
        ({'query_id': 0}, Code.UNKNOWN_QUERY, 'never asked'),
        ({'query_id': -3}, Code.UNKNOWN_QUERY, 'never asked'),
        ({'verdict': 9}, Code.INVALID_VERDICT, 'verdict 9 is unknown; allowed: 0 ANSWER'),
        ({'verdict': -1}, Code.INVALID_VERDICT, 'unknown'),
        ({'preferred': (4,)}, Code.INVALID_ACTION, r'\[4\] must name each action once, out of 0 NORTH'),
        ({'avoided': (-1,)}, Code.INVALID_ACTION, 'once'),
        ({'preferred': (EAST, EAST)}, Code.INVALID_ACTION, 'once'),
        ({'preferred': ()}, Code.EMPTY_SETS, 'no action is preferred'),
        ({'avoided': ()}, Code.EMPTY_SETS, 'no action is avoided'),
        ({'preferred': (), 'avoided': ()}, Code.EMPTY_SETS, 'no action is preferred'),
        ({'avoided': (EAST, WEST)}, Code.OVERLAPPING_SETS, 'EAST preferred and avoided at once'),
    ],
)
def test_wrong_answers_have_their_code_and_change_nothing(given: dict[str, Any], code: Code, words: str) -> None:
    session = ready()
    told = replace(answer(session), **given)
    outcome = session.submit(told)
    assert (outcome.accepted, outcome.code, outcome.record) == (False, code, None)
    assert re.search(words, outcome.message)
    assert session.log == ()
    assert session.query is not None
    assert session.snapshot() is None


def test_a_second_answer_comes_too_late_before_and_after_learning() -> None:
    session = ready()
    told = answer(session)
    session.submit(told)
    assert session.submit(told).code == Code.ALREADY_ANSWERED
    session.learn()
    assert session.submit(told).code == Code.ALREADY_ANSWERED


def test_a_question_replaced_by_a_newer_one_is_stale() -> None:
    session = ready()
    old = answer(session)
    session.add(flights(9)[0])
    assert session.check(old).accepted, 'still open until the new policy is there'
    session.learn()
    assert session.submit(old).code == Code.STALE_QUERY


def test_the_budget_counts_answers_and_not_skips() -> None:
    session = ready(budget=1)
    assert session.submit(answer(session, (), (), Verdict.SKIP)).budget_left == 1
    session.learn()
    assert session.submit(answer(session)).budget_left == 0
    assert session.learn().query is None
    assert session.undo().budget_left == 1
    assert session.learn().query is not None


def test_a_spent_budget_refuses_answers_that_are_still_open() -> None:
    session = ready(budget=0)
    assert session.query is None
    late = ready()
    late.budget = 0
    assert late.submit(answer(late)).code == Code.BUDGET_SPENT


@pytest.mark.parametrize('verdict', [Verdict.SKIP, Verdict.UNSURE])
def test_a_question_passed_over_is_not_asked_again_and_advises_nothing(verdict: Verdict) -> None:
    session = ready()
    before, passed = session.learned, session.query
    assert before is not None
    assert passed is not None
    session.submit(answer(session, (NORTH,), (SOUTH,), verdict))
    assert session.log[0].preferred == ()
    learned = session.learn()
    assert learned.greedy.tolist() == before.greedy.tolist()
    assert learned.query is not None
    assert learned.query.states != passed.states


def test_a_mixed_cluster_is_asked_about_in_halves() -> None:
    session = ready()
    passed = session.query
    assert passed is not None
    session.submit(answer(session, (), (), Verdict.MIXED))
    learned = session.learn()
    assert len(set(learned.clusters[list(passed.states)].tolist())) == 2
    assert learned.clusters.max() == BY_CLUSTERS.clusters, 'one more than before, counted from 0'


def test_undo_takes_the_last_answer_that_holds_and_retract_any() -> None:
    session = ready()
    for _ in range(3):
        session.submit(answer(session))
        session.learn()
    undone = session.undo()
    assert (undone.code, undone.message) == (Code.OK, 'answer 3 is taken back')
    assert session.retract(1).accepted
    assert session.undo().message == 'answer 2 is taken back'
    assert session.undo().message == 'there is no answer to take back'
    assert session.retract(1).message == 'answer 1 was taken back before'
    assert session.retract(7).message == 'answer 7 was never given'
    assert [entry.retracted for entry in session.log] == [False, False, False, True, True, True]


def test_undo_withdraws_the_open_question_and_asks_the_old_one_again() -> None:
    session = ready()
    first = session.query
    session.submit(answer(session))
    session.learn()
    second = answer(session)
    session.undo()
    assert session.query is None
    assert session.submit(second).code == Code.STALE_QUERY
    again = session.learn().query
    assert first is not None
    assert again is not None
    assert (again.query_id, again.states) == (3, first.states)


def test_a_result_that_is_out_of_date_is_not_adopted() -> None:
    session = ready()
    session.submit(answer(session))
    work = session.snapshot()
    assert work is not None
    session.add(flights(9)[0])
    assert not session.adopt(work.run())
    assert session.query is None
    newest = session.learn()
    assert session.snapshot() is None
    assert not session.adopt(newest), 'adopted already'


def test_a_preview_learns_without_committing() -> None:
    session = ready()
    preview = session.preview(answer(session))
    assert isinstance(preview, Work)
    would = preview.run()
    assert session.log == ()
    assert session.snapshot() is None
    session.submit(answer(session))
    assert session.learn().digest == would.digest
    refused = session.preview(Answer(99, Verdict.ANSWER))
    assert not isinstance(refused, Work)
    assert refused.code == Code.UNKNOWN_QUERY


def _asked_again(settings: LearnSettings) -> tuple[Session, Answer]:
    """A session whose open question overlaps with an earlier answer (EAST over WEST) and an opposed answer."""
    session = ready(settings=settings)
    query = session.query
    assert query is not None
    session.restore((record(1, query.states[:1], (EAST,), (WEST,)),))
    session.learn()
    while session.query is not None and query.states[0] not in session.query.states:
        session.submit(answer(session, (), (), Verdict.SKIP))
        session.learn()
    return session, answer(session, (WEST,), (EAST,))


def test_elastic_advice_notes_a_contradiction_and_goes_on() -> None:
    session, opposed = _asked_again(LearnSettings(acquisition='occupancy', clusters=4))
    outcome = session.submit(opposed)
    assert (outcome.accepted, outcome.code, outcome.contradicts) == (True, Code.OK, (1,))
    assert 'contradicts earlier answers: 1' in outcome.message
    assert outcome.record is not None
    assert session.learn().contradictions == (1, outcome.record.advice_id)


def test_strict_advice_refuses_a_contradiction() -> None:
    session, opposed = _asked_again(LearnSettings(acquisition='occupancy', clusters=4, slack_cost=0.0))
    outcome = session.submit(opposed)
    assert (outcome.accepted, outcome.code, outcome.contradicts) == (False, Code.CONTRADICTION, (1,))


def test_a_restored_session_goes_on_where_it_stopped() -> None:
    session = ready()
    for _ in range(2):
        session.submit(answer(session))
        newest = session.learn()
    restored = Session(ROUND_TRIP, BY_CLUSTERS)
    for flight in flights(0):
        restored.add(flight)
    restored.restore(session.log)
    again = restored.learn()
    assert again.digest == newest.digest
    assert (again.query, newest.query) != (None, None)
    assert again.query is not None
    assert newest.query is not None
    assert (again.query.query_id, again.query.states) == (newest.query.query_id, newest.query.states)


@pytest.mark.parametrize(
    ('entry', 'words'),
    [
        (record(1, (64,), (0,), (1,)), 'outside 0 to 63; it belongs to another grid'),
        (record(1, (3,), (5,), (1,)), 'an action twice or outside 0 to 3'),
    ],
)
def test_a_log_that_does_not_fit_is_not_restored(entry: AdviceRecord, words: str) -> None:
    session = ready()
    with pytest.raises(InputError, match=words):
        session.restore((entry,))
    assert session.log == ()


def test_a_drawn_split_is_asked_about_in_its_two_parts() -> None:
    session = ready()
    asked = session.query
    assert asked is not None and len(asked.states) > 2
    part, rest = asked.states[:2], asked.states[2:]
    outcome = session.submit(replace(answer(session, (), (), Verdict.SPLIT), part=part))
    assert outcome.record is not None and (outcome.record.states, outcome.record.verdict) == (part, Verdict.SPLIT)
    learned = session.learn()
    assert {len(set(learned.clusters[list(states)])) for states in (part, rest)} == {1}
    assert learned.clusters[part[0]] != learned.clusters[rest[0]]
    session.undo()
    assert len(set(session.learn().clusters[list(asked.states)])) == 1


@pytest.mark.parametrize('part', ['none', 'all', 'others', 'twice'])
def test_a_split_must_name_some_of_the_states(part: str) -> None:
    session = ready()
    assert session.query is not None
    states = session.query.states
    drawn = {'none': (), 'all': states, 'others': (*states[:1], max(states) + 1), 'twice': states[:1] * 2}[part]
    outcome = session.submit(replace(answer(session, (), (), Verdict.SPLIT), part=drawn))
    assert (outcome.accepted, outcome.code) == (False, Code.INVALID_PART)
