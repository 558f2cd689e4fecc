"""The simulated expert of section 4: knows the route and answers for the plurality of a cluster's states."""

from __future__ import annotations

import numpy as np

from advise_ros.core.advice.advice import Answer, Query, Verdict
from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.numerics import Bools
from advise_ros.core.people.settings import ExpertSettings
from advise_ros.core.planning.routes import optimal_table


class SimulatedExpert:
    """Answers queries like a person who knows the way.

    Preferred are the actions that are optimal in most of the states ('plurality', the paper's choice), and with
    'majority' also those that are optimal in at least half of them: who is asked about the way to a corner says
    "east or south". Avoided are the actions that are optimal in none of the states ('never_optimal', or if there
    is none all others), or always all others ('all_others'). Where nothing is left to avoid the answer is MIXED.

    Args:
        grid: the route.
        rng: of errors and skips.
        avoid: 'never_optimal' or 'all_others'.
        error_rate: share of answers that are wrong.
        skip_rate: share of queries that are skipped.
        expert_id: name in the log.
        prefer: 'majority' or 'plurality'.
        right: (n, n_actions) the actions that are right to this person; None: those of the shortest ways.
    """

    def __init__(  # noqa: PLR0913, PLR0917 - the parameters of a person
        self,
        grid: Grid,
        rng: np.random.Generator,
        avoid: str = ExpertSettings.avoid,
        error_rate: float = ExpertSettings.error_rate,
        skip_rate: float = ExpertSettings.skip_rate,
        expert_id: str = ExpertSettings.expert_id,
        prefer: str = ExpertSettings.prefer,
        right: Bools | None = None,
    ) -> None:
        self._optimal = optimal_table(grid) if right is None else right
        self._rng = rng
        self._avoid, self._prefer = avoid, prefer
        self._error_rate, self._skip_rate = error_rate, skip_rate
        self._expert_id = expert_id

    def answer(self, query: Query) -> Answer:
        """What the expert says to a query."""
        if self._rng.random() < self._skip_rate:
            return Answer(query.query_id, Verdict.SKIP, expert_id=self._expert_id)
        preferred, avoided = self.advice(query.states)
        if not avoided:
            return Answer(query.query_id, Verdict.MIXED, expert_id=self._expert_id)
        if self._rng.random() < self._error_rate:
            preferred, avoided = (int(self._rng.choice(avoided)),), preferred
        return Answer(query.query_id, Verdict.ANSWER, preferred, avoided, self._expert_id)

    def advice(self, states: tuple[int, ...]) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Preferred and avoided actions for the states, without error."""
        votes = self._optimal[list(states)].sum(axis=0)
        enough = min(float(votes.max()), len(states) / 2) if self._prefer == 'majority' else float(votes.max())
        preferred = np.flatnonzero(votes >= max(enough, 1))
        never = np.flatnonzero(votes == 0)
        others = np.setdiff1d(np.arange(N_ACTIONS), preferred)
        avoided = others if self._avoid == 'all_others' or not len(never) else never
        return tuple(preferred.tolist()), tuple(avoided.tolist())
