"""The paper's domains, the people in them, and a process of one's own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from advise_ros.core.advice.advice import Verdict
from advise_ros.core.errors import InputError
from advise_ros.core.people.simulated_demonstrator import Demonstrator, behaviour, demonstrate_task, draw_mistakes
from advise_ros.core.people.simulated_expert import Expert, reply
from advise_ros.domains import DOMAINS, find
from advise_ros.domains.domain import Domain, split_ties

SIZES = {'wumpus': (25, 4), 'sailing': (50, 3), 'traffic': (256, 16), 'drone': (100, 4)}


@pytest.fixture(params=list(DOMAINS))
def domain(request: pytest.FixtureRequest) -> Domain:
    return find(request.param)


def test_sizes_are_the_papers(domain: Domain) -> None:
    assert domain.optimal.shape == SIZES[domain.name]
    assert len(domain.actions) == domain.mdp.n_actions


def test_every_outcome_is_a_distribution(domain: Domain) -> None:
    assert np.allclose(domain.mdp.stacked.sum(axis=1), 1.0)
    assert domain.mdp.stacked.data.min() >= 0.0


def test_an_end_is_never_left_and_an_acting_state_has_an_optimal_action(domain: Domain) -> None:
    n = domain.mdp.n_states
    for action in range(domain.mdp.n_actions):
        stays = domain.mdp.outcomes(np.arange(n), np.full(n, action)).diagonal()
        assert np.allclose(stays[domain.goal], 1.0)
    assert domain.optimal[domain.acting].any(axis=1).all()
    assert not domain.optimal[domain.ended].any()


def test_the_optimal_policy_does_what_the_paper_asks(domain: Domain) -> None:
    uniform = domain.performance(np.full(domain.optimal.shape, 1.0 / domain.mdp.n_actions))
    if domain.measure.higher_is_better:
        assert domain.best_performance == pytest.approx(100.0)
        assert uniform < 20.0
    else:
        assert domain.best_performance < 0.7 * uniform


def test_performance_is_that_of_simulated_runs() -> None:
    """Sailing under a policy that only sails across: exact against 20000 simulated boats."""
    lake, rng = find('sailing'), np.random.default_rng(0)
    across = np.zeros(lake.optimal.shape)
    across[:, 0] = 1.0
    here = rng.choice(50, size=20000, p=lake.start)
    cumulative = lake.mdp.outcomes(np.arange(50), np.zeros(50, dtype=np.int64)).toarray().cumsum(axis=1)
    for _ in range(lake.horizon):
        here = (cumulative[here] < rng.random((len(here), 1))).sum(axis=1)
    assert lake.performance(across) == pytest.approx(100.0 * lake.goal[here].mean(), abs=1.5)


def test_ties_are_divided() -> None:
    assert split_ties(np.array([[True, True, False], [False, False, False]])) == pytest.approx(
        np.array([[0.5, 0.5, 0.0], [1 / 3, 1 / 3, 1 / 3]])
    )


# -- demonstrators -----------------------------------------------------------------------------------
def test_a_demonstrator_errs_in_kinds_of_states_and_the_same_way_in_each(domain: Domain) -> None:
    person = Demonstrator(10, 5, mistake_share=0.25)
    for seed in range(20):
        wrong = draw_mistakes(domain, person, np.random.default_rng(seed))
        states = np.flatnonzero(wrong >= 0)
        assert len(states) == pytest.approx(0.25 * len(domain.acting), abs=2)
        assert not domain.optimal[states, wrong[states]].any()
        for kind in np.unique(domain.habit[states]):
            assert len(np.unique(wrong[states][domain.habit[states] == kind])) == 1


def test_the_largest_kind_comes_first_when_asked_for() -> None:
    junction = find('traffic')
    person = Demonstrator(10, 5, kinds='largest', mistake_share=0.2)
    wrong = draw_mistakes(junction, person, np.random.default_rng(1))
    assert set(junction.habit[wrong >= 0]) == {np.bincount(junction.habit).argmax()}


def test_without_habits_the_same_share_of_the_states_has_mistakes_of_many_kinds() -> None:
    domain = find('sailing')
    wrong = draw_mistakes(domain, Demonstrator(10, 5, kinds='each'), np.random.default_rng(1))
    mistaken = np.flatnonzero(wrong >= 0)
    assert len(mistaken) == round(0.25 * len(domain.acting))
    assert not domain.optimal[mistaken, wrong[mistaken]].any()
    assert len({*zip(domain.habit[mistaken].tolist(), wrong[mistaken].tolist(), strict=True)}) > 2


def test_demonstrations_are_as_noisy_as_said(domain: Domain) -> None:
    person = Demonstrator(20_000, 5, mistake_share=0.25, mistake_rate=0.75, noise_rate=0.1)
    counts = demonstrate_task(domain, person, np.random.default_rng(3))
    shares = behaviour(domain, person, draw_mistakes(domain, person, np.random.default_rng(3)))
    expected = counts.visits[:, None] * shares
    assert np.abs(counts.taken - expected).sum() < 0.1 * counts.taken.sum()
    assert not counts.taken[domain.ended].any()


def test_the_same_seed_gives_the_same_demonstrations(domain: Domain) -> None:
    one, other, third = (
        demonstrate_task(domain, Demonstrator(20, 5), np.random.default_rng(seed)).taken for seed in (1, 1, 2)
    )
    assert np.array_equal(one, other)
    assert not np.array_equal(one, third)


def test_starts_are_those_of_the_task_unless_uniform() -> None:
    room = find('drone')
    counts = demonstrate_task(room, Demonstrator(50, 1, restarts='start'), np.random.default_rng(0))
    assert np.flatnonzero(counts.visits).tolist() == np.flatnonzero(room.start).tolist()


# -- experts -----------------------------------------------------------------------------------------
CLUSTER = np.array([[True, False, False, False], [True, False, False, False], [False, True, False, False]])


PAPERS = Expert(prefer='plurality')


def test_an_expert_prefers_the_plurality_and_avoids_what_is_never_right() -> None:
    rng = np.random.default_rng(0)
    assert reply(PAPERS, CLUSTER, rng) == (Verdict.ANSWER, (0,), (2, 3))
    assert reply(replace(PAPERS, avoid='all_others'), CLUSTER, rng) == (Verdict.ANSWER, (0,), (1, 2, 3))


def test_an_expert_errs_and_skips_as_often_as_said() -> None:
    rng = np.random.default_rng(0)
    replies = [reply(replace(PAPERS, error_rate=0.2, skip_rate=0.5), CLUSTER, rng) for _ in range(4000)]
    given = [said for said in replies if said.verdict is Verdict.ANSWER]
    assert len(given) / 4000 == pytest.approx(0.5, abs=0.03)
    assert sum(said.preferred != (0,) for said in given) / len(given) == pytest.approx(0.2, abs=0.03)


def test_nothing_is_said_where_every_action_is_right() -> None:
    assert reply(PAPERS, np.ones((2, 4), dtype=np.bool_), np.random.default_rng(0)) == (Verdict.MIXED, (), ())


# -- one's own process -------------------------------------------------------------------------------
def corridor(**changes: object) -> dict[str, object]:
    """Three cells, action 0 forward and 1 back; the last one is the goal."""
    return {
        'n_states': 3, 'n_actions': 2, 'gamma': 0.9, 'p_action': [0, 0, 0, 1, 1, 1], 'p_from': [0, 1, 2, 0, 1, 2],
        'p_to': [1, 2, 2, 0, 0, 2], 'p_prob': np.ones(6), 'reward': [0.0, 0.0, 1.0], 'goal': [0, 0, 1],
        'start': [1.0, 0.0, 0.0], 'horizon': 2, **changes,
    }


def saved(path: Path, fields: dict[str, object]) -> str:
    np.savez(path, **fields)  # type: ignore[arg-type]
    return str(path)


def test_a_process_of_ones_own_is_read(tmp_path: Path) -> None:
    own = find(saved(tmp_path / 'corridor.npz', corridor()))
    assert (own.name, own.acting.tolist(), own.best_performance) == ('corridor', [0, 1], 100.0)
    assert own.optimal[:2].tolist() == [[True, False], [True, False]]


@pytest.mark.parametrize(('changes', 'told'), [
    ({'gamma': 1.0}, "'gamma' is 1"),
    ({'gamma': 'high'}, "'gamma' holds"),
    ({'p_prob': np.full(6, 0.5)}, "'p_prob' is no process"),
    ({'p_prob': np.ones(5)}, "'p_prob' has 5 entries"),
    ({'p_to': [1, 2, 3, 0, 0, 2]}, "'p_to' holds 3; allowed is 0 to 2"),
    ({'reward': [0.0, np.nan, 1.0]}, "'reward' holds nan"),
    ({'reward': [0.0]}, "'reward' has 1 entries"),
    ({'start': [1.0, 1.0, 0.0]}, "'start' sums to 2"),
    ({'start': [1.5, -0.5, 0.0]}, "'start' holds -0.5"),
    ({'horizon': [2]}, "'horizon' has shape (1,); it needs to be a single value"),
    ({'features': np.full((3, 1), np.inf)}, "'features' holds inf; it needs finite numbers"),
    ({'goal': [0, 2, 1]}, "'goal' holds numbers beside 0 and 1"),
    ({'features': np.zeros(3)}, "'features' has shape (3,)"),
    ({'rewards': [0.0]}, "'rewards' is unknown"),
    ({'p_to': [0, 1, 2, 0, 1, 2]}, "'p_to' leads from no state to another"),
    ({'reward': np.array([None, 1, 2], dtype=object)}, "'reward' holds Python objects"),
])
def test_what_is_wrong_with_a_file_is_told_with_the_field(tmp_path: Path, changes: dict[str, object], told: str) -> None:
    with pytest.raises(InputError) as caught:
        find(saved(tmp_path / 'own.npz', corridor(**changes)))
    assert told in str(caught.value)


@pytest.mark.parametrize('content', [b'', b'not a zip', b'PK\x03\x04 cut off'])
def test_what_is_no_npz_is_told(tmp_path: Path, content: bytes) -> None:
    (tmp_path / 'own.npz').write_bytes(content)
    with pytest.raises(InputError, match=r'own\.npz cannot be read'):
        find(str(tmp_path / 'own.npz'))
