"""Small grids, demonstrations and answers for the learner's tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from advise_ros.core.advice.advice import AdviceRecord, Answer, Verdict
from advise_ros.core.demonstrations.demonstration import Audit, Demonstration, EndReason
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.session import Session
from advise_ros.core.people.trial import TrialSettings, fly

ROUND_TRIP = Grid(2.0, 4, 4, (-1.0, -1.0), 3.0, (3, 15, 12, 0))
CORRIDOR = Grid(1.0, 4, 1, (0.0, 0.0), 2.0, (3,))
NORTH, EAST, SOUTH, WEST = range(4)
# Asks about clusters, and is quick to learn with.
BY_CLUSTERS = LearnSettings(acquisition='occupancy')


def demonstration(grid: Grid, moves: Sequence[tuple[int, int]], name: str = 'test') -> Demonstration:
    """A demonstration of (state, action) moves, one a second."""
    states, actions = tuple(s for s, _ in moves), tuple(a for _, a in moves)
    stamps = tuple(second * 10**9 for second in range(len(moves)))
    return Demonstration(
        name, 'test', grid, states, actions, stamps, (0, len(moves) * 10**9), EndReason.FINAL_WAYPOINT, Audit(),
    )


def taken_back(earlier: Demonstration, at_ns: int = 10**12) -> Demonstration:
    """What the recorder publishes to take a demonstration back."""
    return replace(
        earlier, states=(), actions=(), stamps_ns=(), window_ns=(at_ns, at_ns), end_reason=EndReason.STOPPED,
        audit=Audit(notes=('taken back',)),
    )


def flights(seed: int, number: int = 4, grid: Grid = ROUND_TRIP, noise_rate: float = 0.4) -> tuple[Demonstration, ...]:
    """Noisy flights of a simulated pilot."""
    return fly(grid, TrialSettings(flights=number, noise_rate=noise_rate), np.random.default_rng(seed))


def record(
    number: int, states: Sequence[int], preferred: Sequence[int], avoided: Sequence[int], *,
    verdict: Verdict = Verdict.ANSWER, retracted: bool = False,
) -> AdviceRecord:
    """An entry of the log about its own query."""
    return AdviceRecord(number, number, tuple(states), tuple(preferred), tuple(avoided), verdict, retracted=retracted)


def ready(seed: int = 0, settings: LearnSettings | None = None, budget: int = -1) -> Session:
    """A session with a first policy and an open question."""
    session = Session(ROUND_TRIP, settings or BY_CLUSTERS, budget)
    for flight in flights(seed):
        session.add(flight)
    session.learn()
    return session


def answer(
    session: Session,
    preferred: Sequence[int] = (EAST,),
    avoided: Sequence[int] = (WEST,),
    verdict: int = Verdict.ANSWER,
) -> Answer:
    """An answer to the open question."""
    assert session.query is not None
    return Answer(session.query.query_id, verdict, tuple(preferred), tuple(avoided))
