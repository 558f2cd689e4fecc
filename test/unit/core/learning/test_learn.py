"""Learning from hand-made demonstrations and answers."""

from __future__ import annotations

import numpy as np
import pytest

from advise_ros.config import AdviseConfig
from advise_ros.core.demonstrations.demonstration import count
from advise_ros.core.errors import InputError
from advise_ros.core.grid.tables import occurring
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.learner import learn
from advise_ros.core.planning.rollout import optimal_table, rollout
from advise_ros.demo.options import node_config
from advise_ros.settings import learn_settings
from support.learning import (
    BY_CLUSTERS,
    CORRIDOR,
    EAST,
    NORTH,
    ROUND_TRIP,
    WEST,
    demonstration,
    flights,
    record,
    taken_back,
)
from support.paths import ROOT

FLOWN_RIGHT = demonstration(CORRIDOR, [(0, EAST), (1, EAST), (2, EAST)])
FLOWN_LOST = demonstration(CORRIDOR, [(0, EAST), (1, WEST), (0, EAST), (1, WEST), (0, EAST), (1, EAST), (2, EAST)])


def test_without_demonstrations_there_is_nothing_to_learn() -> None:
    for nothing in ((), (FLOWN_RIGHT, taken_back(FLOWN_RIGHT))):
        with pytest.raises(InputError, match='there is no demonstration yet'):
            learn(CORRIDOR, BY_CLUSTERS, nothing, ())


def test_counts_leave_out_what_is_done_after_the_end() -> None:
    counts = count(CORRIDOR, [demonstration(CORRIDOR, [(1, EAST), (1, WEST), (1, WEST), (3, NORTH)])])
    assert counts.taken.tolist() == [[0, 0, 0, 0], [0, 1, 0, 2], [0, 0, 0, 0], [0, 0, 0, 0]]
    assert counts.favourite().tolist() == [-1, WEST, -1, -1]
    assert counts.distribution(1.0)[1].tolist() == pytest.approx([1 / 7, 2 / 7, 1 / 7, 3 / 7])


def test_equal_counts_favour_the_lower_action() -> None:
    assert count(CORRIDOR, [demonstration(CORRIDOR, [(1, WEST), (1, EAST)])]).favourite()[1] == EAST


def test_a_right_flight_is_learnt_and_the_goal_is_worth_most() -> None:
    learned = learn(CORRIDOR, BY_CLUSTERS, (FLOWN_RIGHT,), ())
    assert rollout(CORRIDOR, learned.greedy.tolist(), 0, 3).reached
    assert learned.value.argmax() == CORRIDOR.goal_state
    assert learned.unmet == ()


def test_advice_mends_a_systematic_mistake() -> None:
    before = learn(CORRIDOR, BY_CLUSTERS, (FLOWN_LOST,), ())
    after = learn(CORRIDOR, BY_CLUSTERS, (FLOWN_LOST,), (record(1, (1,), (EAST,), (WEST,)),))
    assert not rollout(CORRIDOR, before.greedy.tolist(), 0, 9).reached
    assert rollout(CORRIDOR, after.greedy.tolist(), 0, 9).reached


def test_a_retracted_answer_is_forgotten() -> None:
    log = (record(1, (1,), (EAST,), (WEST,)), record(1, (1,), (EAST,), (WEST,), retracted=True))
    never, retracted = (learn(CORRIDOR, BY_CLUSTERS, (FLOWN_LOST,), told) for told in ((), log))
    assert retracted.digest == never.digest
    assert (never.log_length, retracted.log_length) == (0, 2)


def test_answers_that_oppose_each_other_are_named() -> None:
    log = (
        record(1, (0,), (EAST,), (WEST,)), record(2, (1, 2), (EAST,), (WEST,)), record(3, (1,), (WEST,), (EAST,)),
    )
    learned = learn(CORRIDOR, BY_CLUSTERS, (FLOWN_RIGHT,), log)
    assert learned.contradictions == (2, 3)
    assert learned.unmet == (1,)


def test_a_contradiction_over_two_cells_is_found_by_its_slack() -> None:
    """East in cell 1 and west in cell 2, each over staying: each cell would have to be worth more than the other."""
    log = (record(1, (1,), (EAST,), (NORTH,)), record(2, (2,), (WEST,), (NORTH,)))
    learned = learn(CORRIDOR, BY_CLUSTERS, (FLOWN_RIGHT,), log)
    assert learned.contradictions
    assert learned.unmet


def test_strict_advice_that_cannot_hold_is_refused_in_words() -> None:
    log = (record(4, (1,), (EAST,), (WEST,)), record(6, (1,), (WEST,), (EAST,)))
    with pytest.raises(InputError, match='answers 4 and 6 cannot hold together and slack_cost is 0'):
        learn(CORRIDOR, LearnSettings(acquisition='occupancy', slack_cost=0.0), (FLOWN_RIGHT,), log)


def test_advice_against_the_demonstrations_is_no_contradiction() -> None:
    learned = learn(CORRIDOR, BY_CLUSTERS, (FLOWN_RIGHT,), (record(1, (2,), (WEST,), (EAST,)),))
    assert learned.contradictions == ()


def test_the_query_describes_its_cluster() -> None:
    settings = LearnSettings(acquisition='occupancy', clusters=4, cluster_features=1.0)
    log = (record(1, (1,), (EAST,), (WEST,)),)
    learned = learn(ROUND_TRIP, settings, flights(0), log, version=5, next_query_id=8, budget=3)
    query = learned.query
    assert query is not None
    states = list(query.states)
    assert (query.query_id, query.policy_version, query.budget_left) == (8, 5, 2)
    assert states == np.flatnonzero(learned.clusters == learned.clusters[states[0]]).tolist()
    assert query.uncertainty == pytest.approx(learned.state_uncertainty[states].mean())
    assert query.uncertainty == pytest.approx(0.5 * query.demonstration_uncertainty + 0.5 * query.policy_uncertainty)
    assert query.demonstrated == pytest.approx(learned.demonstrated[states].mean(axis=0))
    assert query.policy == pytest.approx(learned.probabilities[states].mean(axis=0))
    assert query.answered_before == tuple(state for state in states if state == 1)
    assert query.question.startswith('Flying to waypoint') and ': which way in ' in query.question


def test_a_cluster_is_asked_again_when_demonstrations_made_another_of_it() -> None:
    settings = LearnSettings(acquisition='occupancy', clusters=3, cluster_features=1.0)
    learned = learn(ROUND_TRIP, settings, flights(0), ())
    clusters = [tuple(np.flatnonzero(learned.clusters == label).tolist()) for label in range(3)]
    all_told = tuple(record(number, states, (EAST,), (WEST,)) for number, states in enumerate(clusters, start=1))
    assert learn(ROUND_TRIP, settings, flights(0), all_told).query is None
    small_part = record(1, clusters[0][:2], (EAST,), (WEST,))
    again = learn(ROUND_TRIP, settings, flights(0), (small_part, *all_told[1:])).query
    assert again is not None
    assert again.states == clusters[0]
    assert again.answered_before == clusters[0][:2]


def test_perfect_advice_everywhere_flies_the_shortest_way() -> None:
    optimal = optimal_table(ROUND_TRIP)
    log = tuple(
        record(state + 1, (state,), np.flatnonzero(row).tolist(), np.flatnonzero(~row).tolist())
        for state, row in enumerate(optimal) if row.any()
    )
    learned = learn(ROUND_TRIP, BY_CLUSTERS, flights(0), log)
    assert rollout(ROUND_TRIP, learned.greedy.tolist(), ROUND_TRIP.start_state(), 12).reached
    assert all(optimal[state, learned.greedy[state]] for state in np.flatnonzero(occurring(ROUND_TRIP)))


def test_settings_come_from_parameters_of_the_same_name() -> None:
    assert learn_settings(AdviseConfig()) == LearnSettings()


def test_one_file_is_the_way_back_to_the_paper() -> None:
    assert learn_settings(node_config(ROOT / 'config/paper.yaml', 'advise', AdviseConfig)) == LearnSettings(
        reading='literal', margin_cap=0.0, clusters=10, cluster_features=0.0, acquisition='paper', confirm=False, temperature=1.0,
    )


def test_parameters_become_settings() -> None:
    assert learn_settings(AdviseConfig(gamma=0.5, clusters=3, solver='cvxpy')) == LearnSettings(
        gamma=0.5, clusters=3, solver='cvxpy',
    )
