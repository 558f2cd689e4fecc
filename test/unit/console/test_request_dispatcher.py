"""What a page sends is checked before it goes anywhere; what it shows is made of the graph's messages."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from std_srvs.srv import Trigger

from advise_msgs.srv import AnswerQuery, PreviewAnswer
from advise_ros.console import request_check, views, wording
from advise_ros.console.board import Board, newer
from advise_ros.console.language import words
from advise_ros.console.requests import reply_of
from advise_ros.core.advice.advice import Answer, Verdict
from advise_ros.core.errors import InputError
from support.learning import CORRIDOR, EAST, WEST, demonstration, ready, record

SENT = {'query': 3, 'verdict': 0, 'preferred': [1], 'avoided': [3], 'by': 'Anna', 'comment': 'no\x00w\n'}


def test_an_answer_is_read_and_what_does_not_print_dropped() -> None:
    assert request_check.answer_of(SENT) == Answer(3, 0, (1,), (3,), 'Anna', 'now')
    assert request_check.answer_of({'query': 3, 'verdict': 4, 'part': [7, 8]}) == Answer(3, Verdict.SPLIT, part=(7, 8))


@pytest.mark.parametrize(('change', 'words'), [
    ({'query': '3'}, 'query must be a whole number'),
    ({'query': True}, 'query must be a whole number'),
    ({'query': -1}, 'from 0'),
    ({'verdict': 5}, 'verdict must be a whole number from 0 to 4'),
    ({'preferred': 1}, 'preferred must be a list'),
    ({'preferred': [1.5]}, 'preferred must hold whole numbers'),
    ({'avoided': list(range(17))}, 'avoided must be a list of at most 16'),
    ({'by': 61 * 'x'}, 'by must be a text of at most 60'),
    ({'comment': ['x']}, 'comment must be a text'),
    ({'comment': 501 * 'x'}, 'at most 500'),
    ({'part': [10**9]}, 'part must hold'),
])  # fmt: skip
def test_what_is_no_answer_is_refused_in_words(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        request_check.answer_of({**SENT, **change})


def test_an_answer_without_an_id_of_its_own_is_refused() -> None:
    with pytest.raises(InputError, match='uid is empty'):
        request_check.unique_id(SENT)


def test_a_board_gives_each_reader_what_is_new() -> None:
    board = Board()
    assert board.put('map', {'width': 3}) and not board.put('map', {'width': 3})
    seen = board.sections
    assert board.put('map', {'width': 4}) and board.put('log', [])
    assert seen['map'].value == {'width': 3}, 'a reader keeps what it took'
    known = {name: section.version for name, section in seen.items()}
    assert {name: section.value for name, section in newer(board.sections, known).items()} == {'map': {'width': 4}, 'log': []}
    assert not newer(board.sections, {name: section.version for name, section in board.sections.items()})


def test_levels_span_from_the_smallest_to_the_largest() -> None:
    assert views.levels(np.array([0.0, 1.0, 0.5])) == '0zi'
    assert views.levels(np.array([0.3, 0.3])) == '00'


def test_flown_counts_are_those_of_the_visited_states() -> None:
    flown = demonstration(CORRIDOR, [(0, EAST), (1, WEST), (0, EAST), (1, EAST)])
    assert views.flown_view(CORRIDOR, (flown,)) == {
        'demonstrations': 1, 'states': [0, 1], 'taken': [0, 2, 0, 0, 0, 1, 0, 1],
    }


def test_moments_are_the_runs_through_the_question() -> None:
    session = ready()
    query = session.query
    assert query is not None
    found = views.moments_of(query, session.grid, session.demonstrations)
    assert 0 < len(found) <= views.MOMENTS
    for moment in found:
        assert len(moment['cells']) == len(moment['seconds']) and moment['seconds'][0] == 0.0
        assert moment['inside'][0] <= moment['inside'][1] < len(moment['cells'])


def test_the_log_marks_what_was_taken_back() -> None:
    given, other = record(1, (0, 1), (EAST,), (WEST,)), record(2, (2,), (), (), verdict=Verdict.SKIP)
    taken_back = record(1, (0, 1), (EAST,), (WEST,), retracted=True)
    shown = views.log_view([(given, 10**9), (other, 2 * 10**9), (taken_back, 3 * 10**9)])
    told = [(view['id'], view['entry'], view['retracted'], view['at']) for view in shown]
    assert told == [(1, 1, True, 1.0), (2, 2, False, 2.0)]
    assert [wording.given_in_words(words('en'), view) for view in shown] == ['EAST, not WEST', 'skipped']
    assert wording.given_in_words(words('de'), shown[0]) == 'OST, nicht WEST'


@pytest.mark.parametrize(('response', 'part'), [
    (Trigger.Response(success=True, message='holding'), {'ok': True, 'message': 'holding'}),
    (AnswerQuery.Response(accepted=False, code=7, contradicts=[2]), {'ok': False, 'code': 7, 'contradicts': [2]}),
    (
        PreviewAnswer.Response(valid=True, changed_states=[5], changed_actions=[1], reaches_goal_after=True),
        {'ok': True, 'changed': [5], 'actions': [1], 'reaches': [False, True]},
    ),
])  # fmt: skip
def test_replies_are_plain_values(response: Any, part: dict[str, Any]) -> None:
    reply = reply_of(response)
    assert {name: reply[name] for name in part} == part
