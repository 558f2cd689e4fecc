"""The learner as a process: what it publishes, and what its services reply."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from nav_msgs.msg import OccupancyGrid
from rclpy.serialization import serialize_message
from std_srvs.srv import Trigger
from visualization_msgs.msg import Marker, MarkerArray

from advise_msgs.msg import AdviceQuery, LearnerStatus, Policy
from advise_msgs.srv import PreviewAnswer, RetractAdvice
from advise_ros.config import AdviseConfig
from advise_ros.core.advice.advice import Code, Verdict
from advise_ros.core.grid.grid import Grid
from advise_ros.core.learning.learner import learn
from advise_ros.ros import convert, convert_advice
from advise_ros.settings import learn_settings
from support.graph import Graph
from support.learner import LATCHED, Learner, write_grid
from support.walks import GRID_4X4, everywhere, walk

GRID_40X40 = Grid(2.0, 40, 40, (-1.0, -1.0), 3.0, waypoints=(39, 1599, 1560, 0))


@pytest.fixture
def grid_file(tmp_path: Path) -> str:
    return write_grid(tmp_path, GRID_4X4)


def two_demonstrations(graph: Graph, grid_file: str, **params: object) -> Learner:
    """A learner with its first query open."""
    learner = Learner(graph, grid_file, **params)
    learner.demonstrate(0, 1)
    learner.policy(2, 0)
    return learner


# -- the loop --------------------------------------------------------------------------------
def test_from_a_demonstration_to_a_question_to_an_answer_to_a_better_policy(graph: Graph, grid_file: str) -> None:
    learner = Learner(graph, grid_file, budget=5)
    waiting = learner.status(LearnerStatus.WAITING_FOR_DEMONSTRATIONS)
    assert waiting.message == 'Waiting for demonstrations on /demonstration: 0 of 1.'
    learner.demonstrate(0)
    first = learner.policy(1, 0)
    asked = learner.query_of(first)
    check_policy(first)
    check_query(asked, first)
    check_pictures(graph, asked)
    reply = learner.answer(1, (0,), (2,))
    assert (reply.accepted, reply.code, reply.advice_id, reply.budget_left, list(reply.contradicts)) == (True, Code.OK, 1, 4, [])
    second = learner.policy(1, 1)
    assert second.version == 2 and second.digest != first.digest
    assert learner.query_of(second).budget_left == 4
    assert learner.open_query() == 2
    told = learner.statuses[-1]
    assert (told.policy_version, told.demonstrations, told.answers, told.budget_left) == (2, 1, 1, 4)
    assert told.solve_s > 0
    check_log(learner, asked)
    check_rebuilt(learner, second)


def check_policy(policy: Policy) -> None:
    n = GRID_4X4.n_states
    assert (policy.version, policy.demonstrations, policy.log_length) == (1, 1, 0)
    assert convert.grid_from_msg(policy.grid) == GRID_4X4
    assert (len(policy.greedy), len(policy.probabilities), len(policy.reward), len(policy.value)) == (n, 4 * n, n, n)
    assert all(sum(policy.probabilities[4 * s : 4 * s + 4]) == pytest.approx(1.0, abs=1e-5) for s in range(n))
    assert re.fullmatch('[0-9a-f]{64}', policy.digest)
    assert policy.header.frame_id == 'map' and policy.header.stamp.sec > 0


def check_query(asked: AdviceQuery, policy: Policy) -> None:
    assert (asked.query_id, asked.policy_version, asked.budget_left) == (1, policy.version, 5)
    assert convert.grid_from_msg(asked.grid) == GRID_4X4
    assert list(asked.states) == sorted(set(asked.states)) and len(asked.states) > 0
    assert list(asked.action_names) == ['NORTH', 'EAST', 'SOUTH', 'WEST']
    assert asked.uncertainty == pytest.approx((asked.demonstration_uncertainty + asked.policy_uncertainty) / 2, rel=1e-5)
    assert sum(asked.demonstrated) == pytest.approx(1.0, abs=1e-5) and sum(asked.policy) == pytest.approx(1.0, abs=1e-5)
    assert list(asked.answered_before) == []
    assert '?' in asked.question


def check_pictures(graph: Graph, asked: AdviceQuery) -> None:
    uncertainty, reward = (graph.wait_for(f'advise/{name}', OccupancyGrid, qos=LATCHED) for name in ('uncertainty', 'reward'))
    assert (uncertainty.info.width, uncertainty.info.height, len(uncertainty.data)) == (4, 4, 16)
    assert uncertainty.info.origin.position.x == -1.0 and uncertainty.header.frame_id == 'map'
    assert 0 < max(uncertainty.data) <= 100 and 0 <= min(reward.data) < max(reward.data) <= 100
    markers = graph.wait_for('advise/markers', MarkerArray, qos=LATCHED).markers
    assert markers[0].action == Marker.DELETEALL
    assert sum(len(marker.points) for marker in markers if marker.ns == 'question') == len(asked.states)
    assert [m.text for m in markers if m.ns == 'waypoint_numbers'] == ['1', '2', '3', '4 (final)']


def check_log(learner: Learner, asked: AdviceQuery) -> None:
    (entry,) = learner.log
    assert list(entry.states) == list(asked.states)
    assert (list(entry.preferred), list(entry.avoided), entry.verdict, entry.retracted) == ([0], [2], Verdict.ANSWER, False)
    assert (entry.advice_id, entry.query_id, entry.expert_id, entry.comment) == (1, 1, 'anna', 'a "word"')


def check_rebuilt(learner: Learner, policy: Policy) -> None:
    """The published bytes are a function of the demonstrations and the log (and the stamps)."""
    log = tuple(convert_advice.advice_from_msg(message) for message in learner.log)
    asked = learner.query_of(policy)
    again = learn(
        GRID_4X4, learn_settings(AdviseConfig(acquisition='occupancy')), (walk(GRID_4X4, 0),), log,
        version=policy.version, next_query_id=asked.query_id, budget=5,
    )
    assert again.query is not None
    rebuilt = (
        convert_advice.policy_to_msg(again, convert.stamp_to_ns(policy.header.stamp)),
        convert_advice.query_to_msg(again.query, GRID_4X4, convert.stamp_to_ns(asked.header.stamp)),
    )
    assert [serialize_message(message) for message in rebuilt] == [serialize_message(policy), serialize_message(asked)]


# -- answers of every wrong kind --------------------------------------------------------------
def test_wrong_answers_are_refused_with_the_code_that_fits_and_change_nothing(graph: Graph, grid_file: str) -> None:
    learner = two_demonstrations(graph, grid_file, budget=1)
    stale = learner.open_query()
    learner.demonstrate(2)
    number = learner.query_of(learner.policy(3, 0)).query_id
    refusals = (
        (Code.UNKNOWN_QUERY, 'never asked', (0, (1,), (0,))),
        (Code.UNKNOWN_QUERY, 'never asked', (number + 1, (1,), (0,))),
        (Code.UNKNOWN_QUERY, 'never asked', (2**64 - 1, (1,), (0,))),
        (Code.STALE_QUERY, f'query {number} is open', (stale, (1,), (0,))),
        (Code.INVALID_ACTION, '3 WEST', (number, (4,), (0,))),
        (Code.INVALID_ACTION, 'each action once', (number, (1, 1), (0,))),
        (Code.INVALID_ACTION, '0 NORTH', (number, (1,), (255,))),
        (Code.OVERLAPPING_SETS, 'EAST', (number, (1,), (0, 1))),
        (Code.EMPTY_SETS, 'preferred', (number, (), (0,))),
        (Code.EMPTY_SETS, 'avoided', (number, (1,), ())),
        (Code.INVALID_PART, 'not all', (number, (), (), 4)),
        (Code.INVALID_VERDICT, '2 UNSURE', (number, (1,), (0,), 5)),
    )
    for code, words, arguments in refusals:
        reply = learner.answer(*arguments)
        assert (reply.accepted, reply.code, reply.advice_id, reply.budget_left) == (False, code, 0, 1), reply
        assert words in reply.message
    assert learner.answer(number, (1,), (0,)).budget_left == 0
    assert learner.answer(number, (1,), (0,)).code == Code.ALREADY_ANSWERED
    empty = learner.query_of(learner.policy(3, 1))
    assert (empty.query_id, list(empty.states), empty.budget_left) == (0, [], 0)
    assert empty.question == 'The budget of answers is spent.'
    assert learner.status(LearnerStatus.DONE).query_id == 0
    assert learner.answer(stale, (1,), (0,)).code == Code.BUDGET_SPENT
    assert len(learner.log) == 1


def test_contradictory_answers_are_taken_and_named(graph: Graph, grid_file: str) -> None:
    """Demonstrations make new clusters of states that were answered for; at last an opposite answer meets the first."""
    by_moves_alone = {'cluster_features': 0.0, 'acquisition': 'paper', 'temperature': 1.0}
    learner = two_demonstrations(graph, grid_file, clusters=4, **by_moves_alone)
    assert learner.answer(learner.open_query(), (1,), (0, 2, 3)).accepted
    for number in range(2, 9):
        learner.demonstrate(number)
        asked = learner.query_of(learner.policy(number + 1, 1))
        request = PreviewAnswer.Request(query_id=asked.query_id, preferred=[0], avoided=[1])
        if asked.query_id and asked.answered_before:
            break
    assert graph.call(PreviewAnswer, 'advise/preview', request).valid
    reply = learner.answer(asked.query_id, (0,), (1,))
    assert (reply.accepted, reply.code, list(reply.contradicts)) == (True, Code.OK, [1])
    assert 'contradicts' in reply.message
    learnt = learner.policy(number + 1, 2)
    told = graph.wait_for('advise/status', LearnerStatus, lambda m: m.policy_version == learnt.version, LATCHED)
    assert {1, 2} <= set(told.contradictions)
    assert 'Answers 1, 2 cannot all hold' in told.message


def test_strict_advice_that_cannot_hold_fails_in_words_and_can_be_taken_back(graph: Graph, grid_file: str) -> None:
    learner = two_demonstrations(graph, grid_file, clusters=1, slack_cost=0.0)
    before = learner.policy(2, 0)
    assert learner.answer(learner.open_query(), (1,), (0, 2, 3)).accepted  # At the east border EAST leads nowhere better.
    failed = learner.status(LearnerStatus.FAILED, 'Learning failed: ')
    assert failed.policy_version == before.version
    assert graph.call(Trigger, 'advise/undo').success
    assert learner.policy(2, 2).greedy == before.greedy


# -- taking back, previewing -------------------------------------------------------------------
def test_undo_and_retract_bring_the_earlier_policy_back(graph: Graph, grid_file: str) -> None:
    learner = two_demonstrations(graph, grid_file)
    before = learner.policy(2, 0)
    refused = graph.call(Trigger, 'advise/undo')
    assert not refused.success and 'no answer' in refused.message
    for log_length in (1, 2):
        assert learner.answer(learner.open_query(), (1,), (3,)).advice_id == log_length
        learner.policy(2, log_length)
    assert graph.call(Trigger, 'advise/undo').success
    assert learner.policy(2, 3).digest == learner.policy(2, 1).digest
    for wrong in (2, 77):
        assert not graph.call(RetractAdvice, 'advise/retract', RetractAdvice.Request(advice_id=wrong)).success
    assert graph.call(RetractAdvice, 'advise/retract', RetractAdvice.Request(advice_id=1)).success
    assert learner.policy(2, 4).digest == before.digest
    graph.wait_until(lambda: len(learner.log) == 4)
    assert [(entry.advice_id, entry.retracted) for entry in learner.log] == [(1, False), (2, False), (2, True), (1, True)]


def test_a_preview_tells_what_the_answer_then_does_and_commits_nothing(graph: Graph, grid_file: str) -> None:
    learner = two_demonstrations(graph, grid_file)
    before, number = learner.policy(2, 0), learner.open_query()
    wrong = graph.call(PreviewAnswer, 'advise/preview', PreviewAnswer.Request(query_id=number, preferred=[1], avoided=[1]))
    assert (wrong.valid, wrong.code) == (False, Code.OVERLAPPING_SETS)
    preview = graph.call(PreviewAnswer, 'advise/preview', PreviewAnswer.Request(query_id=number, preferred=[1], avoided=[0, 3]))
    assert (preview.valid, preview.code) == (True, Code.OK)
    assert preview.route_before[0] == preview.route_after[0] == GRID_4X4.start_state()
    assert preview.reaches_goal_before == (preview.route_before[-1] == GRID_4X4.goal_state)
    assert preview.reaches_goal_after == (preview.route_after[-1] == GRID_4X4.goal_state)
    assert preview.solve_s > 0 and 'route would' in preview.message
    assert learner.log == []
    assert learner.answer(number, (1,), (0, 3)).accepted
    after = learner.policy(2, 1)
    assert after.version == before.version + 1  # Nothing was learnt for good in between.
    changed = [state for state, pair in enumerate(zip(before.greedy, after.greedy, strict=True)) if pair[0] != pair[1]]
    assert list(preview.changed_states) == changed
    assert list(preview.changed_actions) == [after.greedy[state] for state in changed]


def test_services_reply_while_it_learns_and_it_stops_at_once(graph: Graph, tmp_path: Path) -> None:
    """Order of events, not times: the replies come before the policy whose learning they fall into."""
    learner = Learner(graph, write_grid(tmp_path, GRID_40X40))
    learner.publish(convert.demonstration_to_msg(everywhere(GRID_40X40, 6000)))
    learner.status(LearnerStatus.LEARNING)
    assert learner.answer(1, (1,), (3,)).code == Code.UNKNOWN_QUERY
    assert not graph.call(Trigger, 'advise/undo').success
    assert not graph.call(PreviewAnswer, 'advise/preview', PreviewAnswer.Request(query_id=1)).valid
    assert learner.policies == []
    assert learner.process.terminate() == 0
    assert learner.policies == []
