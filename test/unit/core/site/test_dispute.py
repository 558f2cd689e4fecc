"""What a question about a site decides: the cells that go with its answer, and the two answers themselves."""

from __future__ import annotations

import numpy as np

from advise_ros.core.advice.advice import Answer, Meaning, Verdict
from advise_ros.core.grid.grid import Grid
from advise_ros.core.people.simulated_expert import by_gesture
from advise_ros.core.site.dispute import MOST_CELLS, dispute_of
from advise_ros.core.site.layout import Bytes, layout_of
from advise_ros.core.site.questions import grasped
from advise_ros.experiments.sites import expert_of, judge
from support.sites import asking

GRID = Grid(2.0, 6, 6, (0.0, 0.0), 5.0, (5, 35, 30, 0))
LAYOUT = layout_of(GRID)
AREA = (2, 3, 8, 9)
MOST_ANSWERS = 6
# Codes of answers: 16 * preferred + avoided.
NORTH_NOT_EAST, EAST_NOT_NORTH = 16 * 1 + 2, 16 * 2 + 1


def maps(*marked: tuple[int, ...]) -> Bytes:
    out = np.zeros((len(marked), 36), dtype=np.uint8)
    for row, cells in enumerate(marked):
        out[row, list(cells)] = 1
    return out


def test_the_cells_that_go_with_the_answer_are_in_dispute() -> None:
    elsewhere = (25, 26)
    believed = maps(AREA, (*AREA, *elsewhere), (), elsewhere)
    codes = np.array([NORTH_NOT_EAST, NORTH_NOT_EAST, EAST_NOT_NORTH, EAST_NOT_NORTH])
    dispute = dispute_of(LAYOUT, believed, codes)
    assert dispute is not None
    assert dispute.cells == AREA
    assert (dispute.keep_out.preferred, dispute.keep_out.avoided) == ((0,), (1,))
    assert (dispute.fly_through.preferred, dispute.fly_through.avoided) == ((1,), (0,))
    entered = [{state % 36 for state in option.route} & set(AREA) for option in (dispute.keep_out, dispute.fly_through)]
    assert not entered[0] and entered[1]


def test_an_area_is_one_piece_of_a_size_that_is_grasped() -> None:
    row = tuple(range(6, 11)) + tuple(range(12, 17)) + tuple(range(18, 23))
    codes = np.array([NORTH_NOT_EAST, EAST_NOT_NORTH])
    dispute = dispute_of(LAYOUT, maps(row, ()), codes)
    assert dispute is not None and len(dispute.cells) == MOST_CELLS
    apart = dispute_of(LAYOUT, maps((2, 3, 26, 27), ()), codes)
    assert apart is not None and apart.cells in ((2, 3), (26, 27))


def test_without_a_cell_that_goes_with_the_answer_nothing_is_in_dispute() -> None:
    assert dispute_of(LAYOUT, maps((2,), (2,)), np.array([NORTH_NOT_EAST, EAST_NOT_NORTH])) is None


def test_gestures_say_mostly_what_directions_say_and_lead_there() -> None:
    """An expert who sees only the cells in dispute, beside one who names directions in the states asked about."""
    opposed = asked = successes = 0
    for seed in range(3):
        site, session = asking(seed, enough=0.25)
        expert = expert_of(site, 0.0, np.random.default_rng(seed))
        while (query := session.query) is not None and len(session.log) < MOST_ANSWERS:
            assert [option.meaning for option in query.options] == [Meaning.KEEP_OUT, Meaning.FLY_THROUGH]
            assert 1 <= len(query.disputed) <= MOST_CELLS and query.worth > 0.0
            chosen = by_gesture(query, site.keep_out > 0)
            preferred, avoided = expert.advice(query.states)
            opposed += bool(set(chosen.preferred) & set(avoided) or set(chosen.avoided) & set(preferred))
            asked += 1
            session.submit(Answer(query.query_id, Verdict.ANSWER, chosen.preferred, chosen.avoided))
            session.learn()
        assert session.learned is not None
        successes += judge(site, session.learned.greedy).success
    assert asked >= 3
    assert opposed <= asked / 4
    assert successes == 3


def test_who_does_not_know_is_not_asked_the_same_in_other_words() -> None:
    _, session = asking()
    first = session.query
    assert first is not None
    session.submit(Answer(first.query_id, Verdict.UNSURE))
    second = session.learn().query
    assert second is None or (second.states, second.disputed) != (first.states, first.disputed)


def test_of_pieces_that_tell_the_same_one_of_a_few_cells_is_asked_about() -> None:
    sets = np.ones((3, LAYOUT.n_states), dtype=np.uint8)
    sets[1:, 3:7] = 2
    sets[2, 2] = 4
    best, few, many, otherwise = (5,), (4, 5, 6), (3, 4, 5, 6), (2, 5)
    assert grasped(sets, [best, otherwise, many, few], best) == few
    assert grasped(sets, [best, otherwise], best) == best
