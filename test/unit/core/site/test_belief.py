"""What is believed of a site: held against enumeration, hidden areas and other people."""

from __future__ import annotations

from collections import Counter
from itertools import product

import numpy as np
import pytest

from advise_ros.core.advice.advice import Query
from advise_ros.core.demonstrations.demonstration import count
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.numerics import Floats
from advise_ros.core.people.known_site import Site
from advise_ros.core.site.belief import DOUBT, SamplerSettings, SiteAnswer, SiteBelief, believe, problem_of, tell
from advise_ros.core.site.chain import answer_code, new_chain
from advise_ros.core.site.layout import Bytes, layout_of
from advise_ros.core.site.pilots import PILOTS, best_sets, moves_of
from advise_ros.core.site.plan import plan
from advise_ros.core.site.questions import next_question
from advise_ros.core.site.tempering import TEMPERATURES, draw
from advise_ros.core.site.wishes import ALIKE, GRADED, ONE_WAYPOINT, Wishes
from advise_ros.experiments.sites import expert_of, flights_of, judge, pilot_of, random_site, site_with

# A road of one cell's width through the middle, open at its north end: a row of cells that the map does not tell of.
GRID = Grid(2.0, 6, 6, (0.0, 0.0), 5.0, (5, 35, 30, 0))


@pytest.mark.parametrize('pilot', PILOTS, ids=lambda pilot: pilot.name)
@pytest.mark.parametrize('wishes', [ALIKE, GRADED, ONE_WAYPOINT], ids=lambda wishes: wishes.name)
def test_maps_are_drawn_as_often_as_they_are_likely(pilot: object, wishes: Wishes) -> None:
    edge = 3 if wishes == ALIKE else 2
    grid = Grid(1.0, 3, edge, (0.0, 0.0), 5.0, (2, 3 * edge - 3))
    layout, rng = layout_of(grid), np.random.default_rng(1)
    taken = rng.poisson(1.0, (layout.n_states, 4)) * (layout.acting > 0)[:, None]
    problem = problem_of(layout, moves_of(layout, taken), pilot, (), np.full(grid.n_cells, 0.8), wishes)
    free = np.flatnonzero(np.resize(layout.open_cells, wishes.n_places(layout)) == 0)
    kinds = range(len(problem.wishes.price))
    maps = np.zeros((len(kinds) ** len(free), wishes.n_places(layout)), dtype=np.uint8)
    maps[:, free] = list(product(kinds, repeat=len(free)))
    levels = np.array([new_chain(problem, one).total.sum() for one in maps])
    exact = np.exp(levels - levels.max()) / np.exp(levels - levels.max()).sum()
    draws = draw(problem, np.zeros((len(TEMPERATURES), maps.shape[1]), dtype=np.uint8), 200_000, 4000, rng, fresh=True)
    for level in kinds:
        assert np.abs((draws.maps == level).mean(axis=0) - exact @ (maps == level)).max() < 0.06
    assert levels.max() == new_chain(problem, draws.best).total.sum()


def learnt(seed: int, kind: str = 'errs') -> tuple[object, SiteBelief]:
    site = random_site('6x6-4', np.random.default_rng([seed, 0]))
    pilot = pilot_of(site, kind, 0.4, 0.2, np.random.default_rng([seed, 1]))
    taken = count(site.grid, flights_of(site, pilot, 5)).taken
    return site, believe(layout_of(site.grid), taken, (), np.random.default_rng([seed, 2]))


def test_clumsy_flights_show_where_a_person_does_not_want_to_be() -> None:
    successes, planners = 0, 0
    for seed in range(6):
        site, belief = learnt(seed)
        layout = layout_of(site.grid)
        successes += judge(site, plan(layout, belief.keep_out).greedy).success
        planners += judge(site, plan(layout, np.zeros(layout.n_cells)).greedy).success
    assert successes >= 5
    assert planners <= 1


def test_a_person_who_errs_the_less_the_more_it_costs_is_recognised() -> None:
    assert learnt(3)[1].pilots[0].pilot.name in ('shy', 'bold')
    assert learnt(3, 'soft')[1].pilots[0].pilot.name == 'soft'


def test_where_the_map_says_all_nothing_is_forbidden() -> None:
    site = site_with(GRID, np.zeros(36, dtype=np.uint8))
    pilot = pilot_of(site, 'errs', 0.4, 0.2, np.random.default_rng(5))
    layout = layout_of(GRID)
    belief = believe(layout, count(GRID, flights_of(site, pilot, 5)).taken, (), np.random.default_rng(6))
    assert judge(site, plan(layout, belief.keep_out).greedy).success


def test_without_a_flight_the_plan_is_the_planner_and_answers_alone_teach() -> None:
    keep_out = np.zeros(36, dtype=np.uint8)
    keep_out[[2, 3, 8, 9]] = 1
    site, layout, rng = site_with(GRID, keep_out), layout_of(GRID), np.random.default_rng(7)
    belief = believe(layout, np.zeros((layout.n_states, 4), dtype=np.int64), (), rng, SamplerSettings(maps=40))
    assert plan(layout, belief.keep_out).steps >= plan(layout, np.zeros(36)).steps
    expert = expert_of(site, 0.0, rng)
    for _ in range(6):
        question = next_question(layout, belief, rng)
        if question is None or question.worth < LearnSettings.enough:
            break
        answer = expert.answer(Query(1, 1, question.states, 0.0, 0.0, 0.0, (), (), (), -1, ''))
        belief = tell(layout, belief, SiteAnswer(question.states, answer.preferred, answer.avoided), rng)
    assert judge(site, plan(layout, belief.keep_out).greedy).success


def test_the_same_flights_answers_and_seed_give_the_same_maps() -> None:
    one, two = learnt(2)[1], learnt(2)[1]
    assert np.array_equal(one.maps, two.maps)
    assert [pilot.evidence for pilot in one.pilots] == [pilot.evidence for pilot in two.pilots]


def test_a_question_is_about_few_cells_of_one_layer() -> None:
    for seed in range(4):
        site, belief = learnt(seed)
        question = next_question(layout_of(site.grid), belief, np.random.default_rng(0))
        if question is not None:
            assert len({state // site.grid.n_cells for state in question.states}) == 1
            assert len(question.states) <= 6
            assert question.worth > 0.0


def test_doubt_fades_with_an_answer_that_the_moves_bear_out_and_grows_with_one_that_they_do_not() -> None:
    site, belief = learnt(0)
    layout = layout_of(site.grid)
    question = next_question(layout, belief, np.random.default_rng(0))
    assert question is not None and belief.doubt == DOUBT
    believed, doubted = (answers_under(site, maps, question.states) for maps in (belief.maps, belief.doubting))
    usual = believed.most_common(1)[0][0]
    unusual = max(doubted, key=lambda answer: doubted[answer] / (1 + believed[answer]))
    borne_out, not_borne_out = (tell(layout, belief, answer, np.random.default_rng(1)) for answer in (usual, unusual))
    assert 0.0 < borne_out.doubt < DOUBT < not_borne_out.doubt < 1.0


def answers_under(site: Site, maps: Bytes | Floats, states: tuple[int, ...]) -> Counter[SiteAnswer]:
    """How many of the maps call for each answer."""
    every = (answer_code(row, np.array(states, dtype=np.int32), 0, len(states)) for row in best_sets(layout_of(site.grid), maps))
    directions = ([tuple(action for action in range(4) if mask >> action & 1) for mask in answer] for answer in every)
    return Counter(SiteAnswer(states, *sides) for sides in directions)
