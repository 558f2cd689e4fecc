"""The learner's values as messages, maps, markers and words."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker

from advise_msgs.msg import Advice, AdviceQuery
from advise_msgs.srv import AnswerQuery
from advise_ros.commands.question_text import log_text, question_text
from advise_ros.core.advice.advice import AdviceRecord, Answer, Code, Outcome, Query, Verdict
from advise_ros.core.grid.grid import Grid
from advise_ros.core.learning.learner import Learned, learn
from advise_ros.ros import calls, convert_advice, maps
from advise_ros.ros.markers import question_markers
from support.learning import BY_CLUSTERS
from support.walks import GRID_4X4, walk

BLOCKED_GRID = Grid(2.0, 4, 4, (-1.0, -1.0), 3.0, waypoints=(3, 15, 12, 0), blocked=(5, 6))
QUERY = Query(
    7, 3, (4, 5, 20), 0.1, 0.2, 1e-9, (0.1, 0.2, 0.3, 0.4), (0.25,) * 4, (5,), -1, 'Which way?',
)
RECORD = AdviceRecord(3, 7, (4, 5, 20), (1,), (0, 2), Verdict.ANSWER, 'anna', 'go "round"\n', retracted=True)


@pytest.fixture(scope='module')
def learned() -> Learned:
    return learn(BLOCKED_GRID, BY_CLUSTERS, (walk(BLOCKED_GRID, 0),), ())


def test_a_query_comes_back_from_its_message_to_float32() -> None:
    message = convert_advice.query_to_msg(QUERY, GRID_4X4, 1_500_000_000)
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1, 500_000_000)
    travelled = deserialize_message(serialize_message(message), AdviceQuery)
    assert travelled == message
    back = convert_advice.query_from_msg(travelled)
    assert back is not None
    for name in ('uncertainty', 'demonstration_uncertainty', 'policy_uncertainty', 'demonstrated'):
        assert np.allclose(getattr(back, name), getattr(QUERY, name), rtol=1e-6, atol=0.0)
        back = replace(back, **{name: getattr(QUERY, name)})
    assert back == QUERY


def test_no_query_says_why(learned: Learned) -> None:
    nothing = 'There is nothing left to ask.'
    for budget_left, words in ((0, 'The budget of answers is spent.'), (-1, nothing), (2, nothing)):
        message = convert_advice.no_query_to_msg(learned, budget_left, 0)
        assert (message.query_id, list(message.states), message.question) == (0, [], words)
        assert convert_advice.query_from_msg(message) is None


def test_a_record_comes_back_from_its_message() -> None:
    message = convert_advice.advice_to_msg(RECORD, 5)
    assert convert_advice.advice_from_msg(deserialize_message(serialize_message(message), Advice)) == RECORD


def test_an_answer_comes_back_from_its_request() -> None:
    answer = Answer(7, Verdict.ANSWER, (1,), (0, 2), 'anna', 'so')
    assert convert_advice.answer_from_request(convert_advice.answer_to_request(answer)) == answer


@pytest.mark.parametrize('code', Code)
def test_every_code_is_the_message_s_code_of_that_name(code: Code) -> None:
    response = convert_advice.fill_answer(AnswerQuery.Response(), Outcome(code is Code.OK, code, 'words', None, (1, 2), 4))
    assert response.code == getattr(AnswerQuery.Response, code.name)
    assert response.accepted == (code is Code.OK)
    assert (response.message, list(response.contradicts), response.budget_left) == ('words', [1, 2], 4)


@pytest.mark.parametrize('verdict', Verdict)
def test_every_verdict_is_the_message_s_verdict_of_that_name(verdict: Verdict) -> None:
    assert int(verdict) == getattr(AnswerQuery.Request, verdict.name)


def test_the_maps_fold_the_layers_of_a_cell(learned: Learned) -> None:
    uncertainty = maps.uncertainty_map(learned, 0)
    states = [BLOCKED_GRID.state(layer, 9) for layer in range(4)]
    expected = max(learned.state_uncertainty[states]) / math.log(4) * 100
    assert uncertainty.data[9] == pytest.approx(expected, abs=0.51)
    assert [uncertainty.data[cell] for cell in (5, 6)] == [-1, -1]
    reward = maps.reward_map(learned, 0)
    assert reward.data[9] == pytest.approx(50 + 50 * learned.reward[states].mean(), abs=0.51)
    assert uncertainty.info.resolution == 2.0 and uncertainty.info.origin.position.z == 3.0


def test_markers_light_the_question_and_point_where_the_policy_leads(learned: Learned) -> None:
    query = replace(QUERY, states=(4, 7, 20))
    markers = question_markers(learned, query, 0).markers
    assert markers[0].action == Marker.DELETEALL
    assert len({(m.ns, m.id) for m in markers[1:]}) == len(markers) - 1
    lit = {m.id: [(p.x, p.y) for p in m.points] for m in markers if m.ns == 'question'}
    assert lit == {0: [(0.0, 2.0), (6.0, 2.0)], 1: [(0.0, 2.0)]}
    arrows = {m.id: m.points for m in markers if m.ns == 'policy'}
    assert sorted(arrows) == [0, 1]
    tip, left, right = arrows[0][:3]  # Of cell 0 with waypoint 1 next: towards the greedy action's neighbour.
    there = BLOCKED_GRID.centre_enu_m(BLOCKED_GRID.neighbour(0, int(learned.greedy[0])))
    assert math.dist((tip.x, tip.y), there) < math.dist((left.x, left.y), there) == math.dist((right.x, right.y), there)
    assert len(next(m for m in markers if m.ns == 'blocked').points) == 2


def test_without_a_question_the_markers_show_every_layer(learned: Learned) -> None:
    markers = question_markers(learned, None, 0).markers
    assert [m.id for m in markers if m.ns == 'policy'] == [0, 1, 2, 3]
    assert not [m for m in markers if m.ns == 'question']


def test_the_words_to_type() -> None:
    text = calls.how_to_answer('/crew/advise/answer', '/crew', 3)
    assert (
        'ros2 service call /crew/advise/answer advise_msgs/srv/AnswerQuery '
        "\"{query_id: 3, verdict: 0, preferred: [1], avoided: [0, 2, 3], expert_id: 'anna'}\""
    ) in text
    assert './advise answer --query 3 --prefer east --avoid north,south,west --ros-args -r __ns:=/crew' in text
    assert calls.answer_command('/', 3).endswith('south,west')
    assert calls.in_words(Answer(3, 0, (1,), (0, 2))) == 'query 3: prefer EAST, avoid NORTH and SOUTH'
    assert calls.in_words(Answer(3, 3)) == 'query 3: MIXED'


def test_the_question_as_a_map() -> None:
    text = question_text(replace(QUERY, states=(4, 7, 16 + 3), budget_left=2), BLOCKED_GRID)
    assert text.startswith('Query 7 (2 answers left): Which way?')
    first, second = text.split('on the way to waypoint ')[1:]
    assert first.splitlines()[1:5] == ['   3  .  .  2', '   .  .  .  .', '   #  X  X  #', '   4  .  .  1']
    assert second.splitlines()[1:5] == ['   3  .  .  2', '   .  .  .  .', '   .  X  X  .', '   4  .  . #1']


def test_the_log_names_what_was_taken_back() -> None:
    kept = AdviceRecord(2, 4, (1,), (), (), Verdict.UNSURE)
    first = replace(RECORD, retracted=False)
    assert log_text([first, kept, RECORD]).splitlines()[1:] == [
        '  3: query 7: prefer EAST, avoid NORTH and SOUTH, by anna (taken back)',
        '  2: query 4: UNSURE',
    ]
    assert log_text([]) == 'No answers so far.'
