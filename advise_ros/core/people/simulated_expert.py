"""The simulated expert of section 4: knows what is right and answers for most of a cluster's states."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from advise_ros.core.advice.advice import Answer, AnswerOption, Meaning, Query, Verdict
from advise_ros.core.grid.grid import Grid
from advise_ros.core.numerics import Bools
from advise_ros.core.people.settings import ExpertSettings
from advise_ros.core.planning.rollout import optimal_table


@dataclass(frozen=True)
class Expert:
    """How an expert answers.

    Preferred are the actions that are right in most of the states ('plurality', the paper's choice), and with
    'majority' also those that are right in at least half of them: asked about the way to a corner, people say
    "east or south". Avoided are the actions that are right in none of the states ('never_optimal', or if there
    is none all others), or always all others ('all_others').

    Attributes:
        avoid: 'never_optimal' or 'all_others'.
        error_rate: share of answers that are wrong, 0 to 1.
        skip_rate: share of queries that are skipped, 0 to 1.
        prefer: 'majority' or 'plurality'.
    """

    avoid: str = 'never_optimal'
    error_rate: float = 0.0
    skip_rate: float = 0.0
    prefer: str = 'majority'


class Reply(NamedTuple):
    """A verdict with the actions preferred and avoided, each ascending; both empty unless it is an ANSWER."""

    verdict: Verdict
    preferred: tuple[int, ...] = ()
    avoided: tuple[int, ...] = ()


def reply(expert: Expert, right: Bools, rng: np.random.Generator) -> Reply:
    """What an expert says about some states; MIXED where nothing is left to avoid.

    Args:
        expert: how it answers.
        right: (m, n_actions) the right actions of the states.
        rng: of errors and skips.
    """
    if rng.random() < expert.skip_rate:
        return Reply(Verdict.SKIP)
    preferred, avoided = without_error(expert, right)
    if not avoided:
        return Reply(Verdict.MIXED)
    if rng.random() < expert.error_rate:
        preferred, avoided = (int(rng.choice(avoided)),), preferred
    return Reply(Verdict.ANSWER, preferred, avoided)


def without_error(expert: Expert, right: Bools) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Preferred and avoided actions of an expert who does not err.

    Args:
        expert: which actions count as preferred and avoided.
        right: (m, n_actions) right actions of the states asked about.
    """
    votes = right.sum(axis=0)
    enough = min(float(votes.max()), len(right) / 2) if expert.prefer == 'majority' else float(votes.max())
    preferred = np.flatnonzero(votes >= max(enough, 1))
    never = np.flatnonzero(votes == 0)
    others = np.setdiff1d(np.arange(right.shape[1]), preferred)
    avoided = others if expert.avoid == 'all_others' or not len(never) else never
    return tuple(preferred.tolist()), tuple(avoided.tolist())


def by_gesture(query: Query, keep_out: Bools) -> AnswerOption:
    """What somebody chooses of a question's answers of one gesture who sees the cells in dispute and nothing else.

    Args:
        query: with options.
        keep_out: (cells,) those to keep out of; he says so where that holds for half of the cells in dispute.
    """
    meaning = Meaning.KEEP_OUT if 2 * keep_out[list(query.disputed)].sum() >= len(query.disputed) else Meaning.FLY_THROUGH
    return next(option for option in query.options if option.meaning is meaning)


class SimulatedExpert:
    """Answers queries about a known route like a person.

    Args:
        grid: the route.
        rng: of errors and skips.
        avoid, error_rate, skip_rate, prefer: as of `Expert`.
        expert_id: name in the log.
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
        self._right = optimal_table(grid) if right is None else right
        self._rng, self._expert_id = rng, expert_id
        self._expert = Expert(avoid, error_rate, skip_rate, prefer)

    def answer(self, query: Query) -> Answer:
        """What the expert says to a query."""
        said = reply(self._expert, self._right[list(query.states)], self._rng)
        return Answer(query.query_id, said.verdict, said.preferred, said.avoided, self._expert_id)

    def advice(self, states: tuple[int, ...]) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Preferred and avoided actions for the states, without error."""
        return without_error(self._expert, self._right[list(states)])
