"""What the log of answers says, in one value."""

from __future__ import annotations

import numpy as np

from advise_ros.core.advice.advice import Verdict
from advise_ros.core.advice.state import advice_state
from support.learning import EAST, NORTH, WEST, record

TAKEN = np.array([[2, 34, 2, 2]] * 2 + [[9, 1, 1, 1], [0, 0, 0, 0]])


def test_retracted_records_are_not_active_and_skips_are_no_answers() -> None:
    given, skipped = record(1, (0,), (EAST,), (WEST,)), record(2, (1,), (), (), verdict=Verdict.SKIP)
    back = record(3, (2,), (NORTH,), (WEST,))
    state = advice_state((given, skipped, back, record(3, (2,), (NORTH,), (WEST,), retracted=True)))
    assert state.active == (given, skipped)
    assert state.answers == state.followed == (given,)
    assert state.advised == {0}
    assert [state.budget_left(budget) for budget in (-1, 0, 1, 5)] == [-1, 0, 0, 4]


def test_a_question_is_done_with_unless_it_is_to_be_asked_in_parts() -> None:
    log = (
        record(1, (0, 1), (), (), verdict=Verdict.MIXED), record(2, (2,), (), (), verdict=Verdict.MIXED),
        record(3, (3,), (), (), verdict=Verdict.SPLIT), record(4, (4,), (), (), verdict=Verdict.UNSURE),
    )
    state = advice_state(log)
    assert np.flatnonzero(state.asked(6)).tolist() == [2, 4]
    assert state.mixed == ((0, 1), (2,))
    assert state.drawn == ((3,),)


def test_without_demonstrations_every_answer_is_followed_and_none_is_doubtful() -> None:
    right, wrong = record(1, (0, 1), (EAST,), (WEST,)), record(2, (0, 1), (WEST,), (EAST,))
    assert advice_state((right, wrong)).followed == (right, wrong)
    assert advice_state((wrong,)).doubtful is None
    assert advice_state((right, wrong), TAKEN).followed == (right,)
    assert advice_state((wrong,), TAKEN).doubtful == wrong
