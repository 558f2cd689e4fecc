"""The learner's values as messages, maps, markers and words."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker

from advise_msgs.msg import Advice, AdviceQuery, AnswerOption
from advise_msgs.srv import AnswerQuery, PreviewAnswer
from advise_ros.commands.question_text import log_text, question_text
from advise_ros.core.advice.advice import AdviceRecord, Answer, Code, Meaning, Outcome, Query, Verdict
from advise_ros.core.advice.advice import AnswerOption as Option
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.learner import Learned, learn
from advise_ros.ros import calls, convert_advice, maps
from advise_ros.ros.markers import question_markers
from advise_ros.ros.preview import fill_preview
from support.learning import BY_CLUSTERS
from support.walks import GRID_4X4, walk

NORTH, EAST, SOUTH, WEST = range(4)
# Actions around a square of 4 x 4 cells, counter-clockwise from its lower left corner.
SQUARE = np.repeat(np.array([EAST, NORTH, WEST, SOUTH], dtype=np.uint8), 16)
BLOCKED_GRID = Grid(2.0, 4, 4, (-1.0, -1.0), 3.0, waypoints=(3, 15, 12, 0), blocked=(5, 6))
QUERY = Query(
    7, 3, (4, 5, 20), 0.1, 0.2, 1e-9, (0.1, 0.2, 0.3, 0.4), (0.25,) * 4, (5,), -1, 'Which way?',
)
OPTIONS = (
    Option(Meaning.KEEP_OUT, 'on-purpose', 'On purpose: keep out', (0,), (1,), (4, 8)),
    Option(Meaning.FLY_THROUGH, 'by-accident', 'By accident: fly through', (1,), (0,), (4, 5)),
)
ABOUT_SITE = replace(QUERY, states=(4,), disputed=(5, 6), options=OPTIONS, worth=1.5)
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


def test_what_a_question_decides_comes_back_from_its_message() -> None:
    message = deserialize_message(serialize_message(convert_advice.query_to_msg(ABOUT_SITE, GRID_4X4, 0)), AdviceQuery)
    back = convert_advice.query_from_msg(message)
    assert back is not None
    assert (back.disputed, back.options, back.worth) == (ABOUT_SITE.disputed, ABOUT_SITE.options, ABOUT_SITE.worth)
    assert [option.meaning for option in message.options] == [AnswerOption.KEEP_OUT, AnswerOption.FLY_THROUGH]


def test_who_has_enough_advice_would_fly_and_says_in_which_unit(learned: Learned) -> None:
    done = replace(learned, query=None, enough_advice=True, least_worth=LearnSettings.enough, worth_unit='steps saved')
    sentence = 'I would fly it now: no question is worth an answer any more (each less than 2.5 steps saved).'
    assert convert_advice.no_query_to_msg(done, -1, 0).question == sentence


@pytest.mark.parametrize(('acquisition', 'unit', 'least'), [
    ('site', 'steps saved', LearnSettings.enough), ('occupancy', 'nat^2 a visit', 0.0), ('belief', 'nat^2 a visit', 0.0),
])  # fmt: skip
def test_the_unit_of_doubt_is_that_of_the_acquisition_in_effect(acquisition: str, unit: str, least: float) -> None:
    """Beliefs need five moves a state; one flight has fewer, and the default decides."""
    found = learn(BLOCKED_GRID, LearnSettings(acquisition=acquisition), (walk(BLOCKED_GRID, 0),), ())
    assert (found.worth_unit, found.least_worth) == (unit, least)


def test_a_preview_counts_what_either_route_enters(learned: Learned) -> None:
    before = replace(learned, grid=GRID_4X4, greedy=SQUARE)
    keep_out = np.zeros(16)
    keep_out[[1, 2]] = 0.9, 0.4
    around = SQUARE.copy()
    around[0], around[4:7], around[7] = NORTH, EAST, SOUTH
    after = replace(before, greedy=around, keep_out=keep_out)
    response = PreviewAnswer.Response()
    fill_preview(response, before, after, 0.1)
    assert (list(response.entered_before), list(response.entered_after)) == ([1], [])
    assert response.expected_entries_before == pytest.approx(1.3)
    assert response.expected_entries_after == 0.0
    assert response.keep_out_after[1] == 90
    assert "enter 0 cells that you likely want kept out of, today's route 1" in response.message


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
        '"{query_id: 3, verdict: 0, preferred: [RIGHT], avoided: [WRONG]}"'
    ) in text
    assert './advise answer --query 3 --prefer RIGHT --avoid WRONG --ros-args -r __ns:=/crew' in text
    assert calls.answer_command('/', 3).endswith('--prefer RIGHT --avoid WRONG')
    assert './advise answer --query 3 --say on-purpose\n' in calls.how_to_answer('/advise/answer', '/', 3, ['on-purpose', 'no'])
    assert calls.in_words(Answer(3, 0, (1,), (0, 2))) == 'query 3: prefer EAST, avoid NORTH and SOUTH'
    assert calls.in_words(Answer(3, 3)) == 'query 3: MIXED'


def test_the_question_as_a_map() -> None:
    text = question_text(replace(QUERY, states=(4, 7, 16 + 3), budget_left=2), BLOCKED_GRID)
    assert text.startswith('Query 7 (2 answers left): Which way?')
    first, second = text.split('on the way to waypoint ')[1:]
    assert first.splitlines()[1:5] == ['   3  .  .  2', '   .  .  .  .', '   #  X  X  #', '   4  .  .  1']
    assert second.splitlines()[1:5] == ['   3  .  .  2', '   .  .  .  .', '   .  X  X  .', '   4  .  . #1']


def test_a_question_about_a_site_offers_its_words_and_marks_what_is_in_dispute() -> None:
    lines = question_text(replace(ABOUT_SITE, states=(4, 8)), BLOCKED_GRID).splitlines()
    assert lines[1] == '  on-purpose: keep out; in the 2 cells asked about NORTH right, EAST wrong'
    assert lines[2] == '  by-accident: fly through; in the 2 cells asked about EAST right, NORTH wrong'
    assert '? in dispute' in lines[4]
    assert lines[6:8] == ['   #  .  .  .', '   #  ?  ?  .']


def test_markers_show_what_is_in_dispute_and_the_ways_after_either_answer(learned: Learned) -> None:
    markers = {m.ns: m for m in question_markers(learned, ABOUT_SITE, 0).markers}
    assert len(markers['disputed'].points) == 2
    keep, through = markers['route_keep_out'], markers['route_fly_through']
    assert (keep.type, len(keep.points)) == (Marker.LINE_STRIP, 3), 'two cells and the waypoint'
    assert (through.type, len(through.points)) == (Marker.LINE_LIST, 4), 'two dashes'


def test_the_log_names_what_was_taken_back() -> None:
    kept = AdviceRecord(2, 4, (1,), (), (), Verdict.UNSURE)
    first = replace(RECORD, retracted=False)
    assert log_text([first, kept, RECORD]).splitlines()[1:] == [
        '  3: query 7: prefer EAST, avoid NORTH and SOUTH, by anna (taken back)',
        '  2: query 4: UNSURE',
    ]
    assert log_text([]) == 'No answers so far.'
