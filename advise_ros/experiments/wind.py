"""Flights in wind: a share of the moves is another one than the person or the policy chose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from advise_ros.core.numerics import Ints
from advise_ros.core.people.known_site import LONGEST, Site
from advise_ros.core.people.simulated_pilot import SimulatedPilot
from advise_ros.core.planning.rollout import expected_success
from advise_ros.core.site.layout import layout_of


class BlownPilot(SimulatedPilot):
    """Another pilot whose moves the wind changes now and then, to any that can be flown; what was flown is what is seen.

    Args:
        pilot: who chooses.
        slip: share of moves that the wind makes.
        rng: of the wind.
    """

    def __init__(self, pilot: SimulatedPilot, slip: float, rng: np.random.Generator) -> None:
        self._pilot, self._slip, self._wind = pilot, slip, rng
        self._moves = layout_of(pilot.grid).moves
        self.grid = pilot.grid

    def action(self, state: int) -> int:
        """The next move that is flown."""
        chosen = self._pilot.action(state)
        if self._wind.random() >= self._slip:
            return chosen
        others = np.flatnonzero(self._moves[state % self.grid.n_cells] >= 0)
        return int(self._wind.choice(others[others != chosen])) if len(others) > 1 else chosen


def success_in_wind(site: Site, greedy: Ints, slip: float) -> float:
    """Probability that a policy arrives within LONGEST times the shortest way and is never blown into a hidden cell.

    Args:
        site: what the person knows; hidden cells end a flight.
        greedy: (states,) actions.
        slip: probability that a move goes elsewhere.
    """
    hidden = tuple(sorted({*site.grid.blocked, *np.flatnonzero(site.keep_out).tolist()}))
    return expected_success(replace(site.grid, blocked=hidden), greedy, slip, LONGEST)
