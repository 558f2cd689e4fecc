"""Clusterings by name, in any process."""

from __future__ import annotations

import numpy as np
import pytest

from advise_ros.core.demonstrations.action_counts import count
from advise_ros.core.numerics import Ints
from advise_ros.core.planning.process import mdp_of, occurring, successors
from advise_ros.core.questions import evidence_clusters
from advise_ros.core.questions.clusterings import CLUSTERINGS, Terrain, Wanted, cluster, neighbours
from advise_ros.core.questions.grid_clusters import structure
from support.learning import EAST, NORTH, ROUND_TRIP, flights

STATES = np.flatnonzero(occurring(ROUND_TRIP))


def _terrain(taken: Ints) -> Terrain:
    return Terrain(mdp_of(ROUND_TRIP, 0.0, 0.95), STATES, taken, 1.0, structure(ROUND_TRIP)[STATES])


def _flown(seed: int = 0, number: int = 4) -> Terrain:
    return _terrain(count(ROUND_TRIP, flights(seed, number)).taken[STATES])


def _two_habits(moves: int) -> tuple[Ints, Ints]:
    """Every other state is flown north, the rest east, with a tenth of the moves elsewhere."""
    habit = np.arange(len(STATES)) % 2
    taken = np.full((len(STATES), 4), moves // 40)
    taken[np.arange(len(STATES)), np.where(habit == 0, NORTH, EAST)] += moves
    return taken, habit


@pytest.mark.parametrize('name', sorted(CLUSTERINGS))
@pytest.mark.parametrize('wanted', [1, 5, 0])
def test_every_state_has_a_cluster_numbered_by_its_lowest_state(name: str, wanted: int) -> None:
    labels = cluster(name, _flown(), Wanted(wanted, 1.0, 0))
    _, first = np.unique(labels, return_index=True)
    assert labels.shape == STATES.shape
    assert np.array_equal(np.unique(labels), np.arange(len(first)))
    assert (np.diff(first) > 0).all()
    assert not wanted or len(first) == wanted


@pytest.mark.parametrize('name', sorted(CLUSTERINGS))
def test_the_same_evidence_makes_the_same_clusters(name: str) -> None:
    first = cluster(name, _flown(3), Wanted(0, 1.0, 7))
    assert np.array_equal(first, cluster(name, _flown(3), Wanted(0, 1.0, 7)))


def test_evidence_tells_behaviours_apart_and_says_how_many_there_are() -> None:
    taken, habit = _two_habits(80)
    assert np.array_equal(cluster('evidence', _terrain(taken), Wanted(0, 0.0, 0)), habit)


def test_few_moves_leave_the_structure_to_decide() -> None:
    taken, _ = _two_habits(1)
    labels = cluster('evidence', _terrain(taken), Wanted(ROUND_TRIP.n_layers, 1.0, 0))
    layers = STATES // ROUND_TRIP.n_cells
    assert all(len(np.unique(layers[labels == label])) == 1 for label in range(ROUND_TRIP.n_layers))


def test_a_route_flown_a_few_times_has_about_a_cluster_a_waypoint() -> None:
    found = [len(np.unique(cluster('evidence', _flown(seed), Wanted(0, 1.0, 0)))) for seed in range(5)]
    assert all(ROUND_TRIP.n_layers <= number <= 2 * ROUND_TRIP.n_layers for number in found)


def test_connected_clusters_hang_together_as_far_as_the_process_does() -> None:
    terrain = _flown()
    labels = cluster('connected', terrain, Wanted(8, 1.0, 0))
    joined = neighbours(terrain).toarray() > 0
    for label in range(8):
        members = np.flatnonzero(labels == label)
        reached = {int(members[0])}
        while grown := {int(j) for i in reached for j in members if joined[i, j]} - reached:
            reached |= grown
        assert len(reached) == len(members)


def test_neighbours_are_what_one_move_joins() -> None:
    table = neighbours(_flown()).toarray() > 0
    assert np.array_equal(table, table.T)
    there = successors(ROUND_TRIP)[STATES[0]]
    assert all(table[0, np.searchsorted(STATES, state)] for state in there if state in STATES)


def test_large_processes_are_joined_from_groups(monkeypatch: pytest.MonkeyPatch) -> None:
    taken, habit = _two_habits(80)
    monkeypatch.setattr(evidence_clusters, 'MOST', 20)
    evidence_clusters._merged.cache_clear()
    labels = evidence_clusters.merge(taken, np.zeros((len(taken), 1)), 0.0, 0)
    assert np.array_equal(labels != labels[0], habit == 1)


def test_joining_costs_what_the_likelihoods_say() -> None:
    same, other = np.array([[30.0, 1.0]]), np.array([[1.0, 30.0]])
    alike = 2 * evidence_clusters.likelihood(same) - evidence_clusters.likelihood(2 * same)
    apart = evidence_clusters.likelihood(same) + evidence_clusters.likelihood(other) - evidence_clusters.likelihood(same + other)
    assert alike[0] < 0.0
    assert apart[0] > evidence_clusters.LIMIT
