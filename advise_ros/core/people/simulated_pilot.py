"""The simulated pilot of section 4: systematic mistakes in some states, random wrong moves elsewhere."""

from __future__ import annotations

import numpy as np

from advise_ros.core.demonstrations.demonstration import Audit, Demonstration, EndReason
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.grid.tables import occurring, successors
from advise_ros.core.numerics import Bools
from advise_ros.core.planning.rollout import optimal_table

# In a state with a mistake, the share of moves that make it (while the noise rate allows).
MISTAKE_RATE = 0.75


class SimulatedPilot:
    """Chooses the moves of a pilot with errors.

    Where several moves are right, the person has the habit of one of them. In `mistake_share` of the
    states that have a wrong move, the same one is taken most of the time; elsewhere wrong moves are
    random, so often that their share over all these states is `noise_rate`. A wrong move brings the
    next waypoint no nearer; it stays on the grid and out of blocked cells.

    Args:
        grid: the route.
        noise_rate: share of wrong moves, 0 to 1.
        mistake_share: share of those states with a systematic mistake, 0 to 1.
        rng: of every random choice.
        right: (n, n_actions) the actions that are right to this person; None: those of the shortest ways.
        possible: (n, n_actions) the actions that wrong moves are drawn from; None: all that stay on the map.
    """

    def __init__(
        self, grid: Grid, noise_rate: float, mistake_share: float, rng: np.random.Generator, *,
        right: Bools | None = None, possible: Bools | None = None,
    ) -> None:
        self.grid = grid
        self._rng = rng
        self._optimal = optimal_table(grid) if right is None else right
        self._wrong = _flyable(grid) & ~self._optimal & (True if possible is None else possible)
        acting = np.flatnonzero(self._optimal.any(axis=1)).tolist()
        self._habits = {state: self._draw(self._optimal[state]) for state in acting}
        self.mistakes = self._choose_mistakes(mistake_share)
        systematic = mistake_share * MISTAKE_RATE
        self._mistake_rate = MISTAKE_RATE if systematic <= noise_rate else noise_rate / mistake_share
        self._random_rate = max(0.0, noise_rate - systematic) / (1.0 - mistake_share) if mistake_share < 1.0 else 0.0

    def _choose_mistakes(self, share: float) -> dict[int, int]:
        """State -> the wrong action that is made there again and again."""
        states = np.flatnonzero(occurring(self.grid) & self._wrong.any(axis=1))
        chosen = np.sort(self._rng.choice(states, round(share * len(states)), replace=False))
        return {int(state): self._draw(self._wrong[state]) for state in chosen}

    def action(self, state: int) -> int:
        """The next move.

        Raises:
            InputError: the flight is over in this state.
        """
        if state not in self._habits:
            raise InputError(f'state {state} ends the flight; there is no move to make')
        mistake = self.mistakes.get(state)
        if mistake is not None:
            wrong = self._rng.random() < self._mistake_rate
            return mistake if wrong else self._habits[state]
        wrong = self._rng.random() < self._random_rate and bool(self._wrong[state].any())
        return self._draw(self._wrong[state]) if wrong else self._habits[state]

    def _draw(self, allowed: Bools) -> int:
        return int(self._rng.choice(np.flatnonzero(allowed)))


def _flyable(grid: Grid) -> Bools:
    """Actions that move to another, free cell, (n, n_actions)."""
    cells = np.arange(grid.n_states) % grid.n_cells
    there = successors(grid) % grid.n_cells
    flyable: Bools = (there != cells[:, None]) & ~np.isin(there, list(grid.blocked))
    return flyable


def demonstrate(grid: Grid, demonstrator: SimulatedPilot, index: int, max_moves: int) -> Demonstration:
    """One flight on the grid model from the start to the goal, or until `max_moves`.

    A move takes one second; its stamp is that of entering the state.
    """
    states = [grid.start_state()]
    actions: list[int] = []
    while not grid.is_terminal(states[-1]) and len(actions) < max_moves:
        actions.append(demonstrator.action(states[-1]))
        states.append(grid.successor(states[-1], actions[-1]))
    reached = states[-1] == grid.goal_state
    stamps_ns = tuple(second * 1_000_000_000 for second in range(len(actions)))
    return Demonstration(
        demonstration_id=f'grid-model-{index}',
        source='grid model',
        grid=grid,
        states=tuple(states[: len(actions)]),
        actions=tuple(actions),
        stamps_ns=stamps_ns,
        window_ns=(0, len(actions) * 1_000_000_000),
        end_reason=EndReason.FINAL_WAYPOINT if reached else EndReason.STOPPED,
        audit=Audit(samples=len(actions)),
    )
