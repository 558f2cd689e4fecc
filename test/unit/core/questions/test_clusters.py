"""k-means over action distributions: labels, guards and splits."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from advise_ros.core.demonstrations.demonstration import Counts
from advise_ros.core.grid.tables import occurring
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.numerics import Ints
from advise_ros.core.planning.process import grid_features, process_of
from advise_ros.core.questions.clusters import (
    FINER,
    NO_CLUSTER,
    canonical,
    cluster_states,
    finer_clusters,
    k_means,
    split,
)
from support.learning import CORRIDOR, ROUND_TRIP

PROCESS = process_of(ROUND_TRIP, 0.0, 0.95)
UNIFORM = Counts(np.zeros((ROUND_TRIP.n_states, 4), dtype=np.int64))


def _by_k_means(features: float, clusters: int, seed: int = 0, counts: Counts = UNIFORM) -> Ints:
    return cluster_states(PROCESS, counts, LearnSettings(clusters=clusters, cluster_features=features, seed=seed))


def test_well_separated_groups_are_found_and_numbered_by_their_first_member() -> None:
    points = np.vstack([np.tile([0.0, 1.0], (5, 1)), np.tile([1.0, 0.0], (3, 1))])[[5, 0, 6, 1, 2, 7, 3, 4]]
    points += np.random.default_rng(0).normal(scale=0.01, size=points.shape)
    assert canonical(k_means(points, 2, 0)).tolist() == [0, 1, 0, 1, 1, 0, 1, 1]


def test_fewer_distinct_points_than_clusters_make_fewer_clusters_in_silence() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        labels = _by_k_means(0.0, 10, 0)
    assert set(labels[occurring(ROUND_TRIP)]) == {0}


def test_states_in_which_no_flight_acts_have_no_cluster() -> None:
    labels = _by_k_means(1.0, 5, 0)
    assert np.array_equal(labels == NO_CLUSTER, ~occurring(ROUND_TRIP))
    assert set(labels) == {NO_CLUSTER, 0, 1, 2, 3, 4}


def test_every_seed_gives_its_own_clusters_again() -> None:
    counts = Counts(np.random.default_rng(0).integers(0, 9, (ROUND_TRIP.n_states, 4)))
    first = _by_k_means(0.5, 6, 3, counts)
    assert np.array_equal(first, _by_k_means(0.5, 6, 3, Counts(counts.taken.copy())))


def test_a_waypoint_counts_as_much_as_the_width_of_the_grid() -> None:
    rows = grid_features(ROUND_TRIP)
    west, east, next_layer = rows[0], rows[3], rows[16]
    assert np.linalg.norm(west - east) == pytest.approx(1.0)
    assert np.linalg.norm(west - next_layer) == pytest.approx(1.0)
    assert np.isfinite(grid_features(CORRIDOR)).all()


def test_a_mixed_cluster_is_halved_and_its_half_again() -> None:
    labels = _by_k_means(0.0, 1, 0)
    whole = tuple(np.flatnonzero(labels == 0).tolist())
    halves = split(PROCESS.features, labels, [whole], 0)
    assert set(halves) == {NO_CLUSTER, 0, 1}
    half = tuple(np.flatnonzero(halves == 0).tolist())
    quarters = split(PROCESS.features, labels, [half, whole], 0)
    assert set(quarters) == {NO_CLUSTER, 0, 1, 2}
    assert np.array_equal(quarters, split(PROCESS.features, labels, [whole, half], 0))


def test_a_drawn_part_and_a_halving_leave_no_trace_of_their_order() -> None:
    labels = np.zeros(ROUND_TRIP.n_states, dtype=np.int64)
    part, rest = (0, 1, 2), tuple(range(3, ROUND_TRIP.n_states))
    cut = split(PROCESS.features, labels, [], 0, [part])
    assert len(set(cut)) == 2 and len(set(cut[list(part)])) == 1
    halved = split(PROCESS.features, labels, [rest], 0, [part])  # The rest is a cluster only once the part is cut off.
    assert len(set(halved)) == 3 and len(set(halved[list(part)])) == 1
    other_way = split(PROCESS.features, labels, [part], 0, [rest])
    assert len(set(other_way[list(rest)])) == 1 and len(set(other_way[list(part)])) == 2


def test_an_answer_about_clusters_of_before_splits_nothing() -> None:
    labels = _by_k_means(1.0, 4, 0)
    assert np.array_equal(split(PROCESS.features, labels, [(1, 2, 40)], 0), labels)


def test_finer_clusters_are_more_and_as_many_at_each_call() -> None:
    counts = Counts(np.random.default_rng(0).integers(0, 9, (ROUND_TRIP.n_states, 4)))
    found = finer_clusters(PROCESS, counts, LearnSettings(clusters=4))
    assert [len(np.unique(labels)) - 1 for labels in found] == [round(4 * more) for more in FINER]


@pytest.mark.parametrize('wanted', [1, 5, 9])
def test_every_acting_state_has_a_cluster_numbered_by_its_lowest_state(wanted: int) -> None:
    counts = Counts(np.random.default_rng(1).integers(0, 9, (ROUND_TRIP.n_states, 4)))
    labels = _by_k_means(1.0, wanted, 0, counts)[PROCESS.acting]
    _, first = np.unique(labels, return_index=True)
    assert np.array_equal(np.unique(labels), np.arange(wanted))
    assert (np.diff(first) > 0).all()
