"""What a person knows of a site beside the map, and what a policy is worth to him."""

from __future__ import annotations

import numpy as np

from advise_ros.core.grid.grid import Grid
from advise_ros.core.people.known_site import judge, site_of, site_with
from advise_ros.core.people.simulated_expert import SimulatedExpert
from advise_ros.core.people.simulated_pilot import SimulatedPilot, demonstrate
from advise_ros.core.planning.rollout import optimal_table

# From cell 0 over the garden in the middle of the bottom row to its other end and back.
GRID, GARDEN = Grid(1.0, 5, 3, (0.0, 0.0), 2.0, (4, 0)), (2,)


def test_without_a_wish_the_shortest_ways_are_right() -> None:
    site = site_of(GRID, ())
    assert site.steps == 8 and site.keep_out.sum() == 0
    np.testing.assert_array_equal(site.right, optimal_table(GRID))
    acting = site_with(GRID, site.keep_out)
    np.testing.assert_array_equal(acting.right, site.right & acting.right.any(axis=1)[:, None])
    assert acting.steps == site.steps


def test_the_planner_crosses_the_garden_and_the_right_ways_go_round() -> None:
    site = site_of(GRID, GARDEN)
    assert site.steps == 12, 'two more each way'
    planner = judge(site, optimal_table(GRID).argmax(axis=1))
    assert planner.arrives and not planner.keeps_out and not planner.success and planner.length == 8 / 12
    assert judge(site, site.right.argmax(axis=1)).success


def test_who_takes_too_long_has_not_arrived() -> None:
    site = site_of(GRID, GARDEN)
    right = site.right.argmax(axis=1)
    assert judge(site, right, longest=1.0).arrives
    assert not judge(site, right, longest=0.9).arrives


def test_a_pilot_without_mistakes_and_an_expert_go_round() -> None:
    site = site_of(GRID, GARDEN)
    pilot = SimulatedPilot(GRID, 0.0, 0.0, np.random.default_rng(0), right=site.right)
    flight = demonstrate(GRID, pilot, 0, 50)
    assert len(flight.states) == site.steps
    assert not {GRID.cell_of(state) for state in flight.states} & set(GARDEN)
    before_it = GRID.state(0, 1)
    assert optimal_table(GRID)[before_it].argmax() == 1, 'the map says east'
    preferred, avoided = SimulatedExpert(GRID, np.random.default_rng(0), right=site.right).advice((before_it,))
    assert preferred == (0,) and 1 in avoided
