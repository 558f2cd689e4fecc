"""What is compared on routes: the learner, and simpler ways that see the same flights."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from advise_ros.core.demonstrations.demonstration import count
from advise_ros.core.grid.grid import Grid
from advise_ros.core.grid.tables import successors
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.learner import Learned, learn
from advise_ros.core.learning.session import Session
from advise_ros.core.numerics import Bools, Ints
from advise_ros.core.people.known_site import Site, judge
from advise_ros.core.people.simulated_pilot import SimulatedPilot, demonstrate
from advise_ros.core.planning.rollout import optimal_table
from advise_ros.core.site import within_advise
from advise_ros.core.site.layout import layout_of
from advise_ros.core.site.plan import plan
from advise_ros.core.site.prior import SitePrior
from advise_ros.experiments.routes import maxent
from advise_ros.experiments.routes.cases import RouteTrial
from advise_ros.experiments.sites import expert_of

MOST_ANSWERS = 10
# After it asks no more, so many questions are asked on, to see whether they would have helped.
BEYOND = 3
# Worth of a question that is asked then, in steps.
ANYTHING = 1e-9
# The learner as the paper prints it, config/paper.yaml.
AS_PRINTED = LearnSettings(
    reading='literal', margin_cap=0.0, clusters=10, cluster_features=0.0, acquisition='paper', confirm=False, temperature=1.0,
)


class WayOutcome(NamedTuple):
    """What came of a way in a trial.

    Attributes:
        curve: success after 0, 1, ... answers, until nothing more was asked.
        planned: with the learner, success of the plan of its belief at the same points; else as `curve`.
        beyond: success after further answers to questions that were no longer worth asking.
        seconds: processor time to the first policy, and after each answer to the next policy and question.
    """

    curve: list[bool]
    planned: list[bool]
    beyond: list[bool]
    seconds: list[float]


def planner(trial: RouteTrial) -> WayOutcome:
    """A shortest way, ties drawn: it knows the map and nothing else."""
    options = optimal_table(trial.site.grid)
    greedy = np.array([trial.rng.choice(np.flatnonzero(row)) if row.any() else 0 for row in options])
    return _at_once(trial.site, lambda: greedy)


def cloning(trial: RouteTrial) -> WayOutcome:
    """The most frequent action; where there is none the shortest way to a state that was flown."""
    return _at_once(trial.site, partial(_cloned, trial))


def _cloned(trial: RouteTrial) -> Ints:
    counts = count(trial.site.grid, trial.flights)
    favourite = counts.favourite()
    return np.where(favourite >= 0, favourite, _toward(successors(trial.site.grid), counts.visits > 0))


def _toward(there: Ints, known: Bools) -> Ints:
    """(states,) the action of a shortest way to a known state."""
    distance = np.where(known, 0, len(known))
    while True:
        nearer = np.minimum(distance, distance[there].min(axis=1) + 1)
        if np.array_equal(nearer, distance):
            return distance[there].argmin(axis=1)
        distance = nearer


def maximum_entropy(trial: RouteTrial) -> WayOutcome:
    """Maximum causal entropy IRL with step cost, goal and one map of cell costs."""
    layout = layout_of(trial.site.grid)
    return _at_once(trial.site, lambda: maxent.fly(layout, maxent.fit(layout, trial.flights)))


def learner(trial: RouteTrial, settings: LearnSettings) -> WayOutcome:
    """Algorithm 1 with some settings, asked until nothing is worth asking."""
    settings = replace(settings, seed=trial.seed)
    _compile()
    session = _session(trial, settings)
    curve, planned, seconds = _asked(session, trial, MOST_ANSWERS)
    if settings.acquisition != 'site':
        return WayOutcome(curve, curve, [], seconds)
    session.settings = replace(settings, enough=ANYTHING)
    session.restore(session.log)
    beyond = _asked(session, trial, min(BEYOND, MOST_ANSWERS - len(session.log)))[0][1:]
    return WayOutcome(curve, planned, beyond, seconds)


def second_route(trial: RouteTrial, *, map_alone: bool = False) -> WayOutcome:
    """What was learnt of the site on the first route, with its answers, flies another one, without a flight there.

    Args:
        trial: with another route.
        map_alone: kept is the probability of each cell in whole per cent, not the flights and answers.
    """
    assert trial.other is not None
    _compile()
    settings = LearnSettings(acquisition='site', seed=trial.seed)
    first = _session(trial, settings)
    _asked(first, trial, MOST_ANSWERS)
    assert first.learned is not None
    session = Session(trial.other.grid, settings, prior=_map(first.learned) if map_alone else first.kept(first.learned))
    expert = expert_of(trial.other, 0.0, trial.rng)
    curve, planned, seconds = _asked(session, trial._replace(site=trial.other, expert=expert), MOST_ANSWERS)
    return WayOutcome(curve, planned, [], seconds)


def _map(learned: Learned) -> SitePrior:
    assert learned.keep_out is not None
    return SitePrior(tuple(np.round(100.0 * learned.keep_out).astype(int).tolist()))


def _session(trial: RouteTrial, settings: LearnSettings) -> Session:
    session = Session(trial.site.grid, settings)
    for flight in trial.flights:
        session.add(flight)
    return session


def second_planned(trial: RouteTrial) -> WayOutcome:
    """The planner on the second route."""
    assert trial.other is not None
    return planner(trial._replace(site=trial.other))


WAYS: dict[str, Callable[[RouteTrial], WayOutcome]] = {
    'planner': planner,
    'cloning': cloning,
    'maxent': maximum_entropy,
    'paper': partial(learner, settings=AS_PRINTED),
    'occupancy': partial(learner, settings=LearnSettings(acquisition='occupancy')),
    'site': partial(learner, settings=LearnSettings(acquisition='site')),
}
SECOND_WAYS: dict[str, Callable[[RouteTrial], WayOutcome]] = {
    'planner': second_planned, 'site': second_route, 'map': partial(second_route, map_alone=True),
}
WAY_NAMES = tuple(dict.fromkeys((*WAYS, *SECOND_WAYS)))


def _asked(session: Session, trial: RouteTrial, most: int) -> tuple[list[bool], list[bool], list[float]]:
    """Success now and after each of at most so many answers, of policy and of plan; seconds of each."""
    curve: list[bool] = []
    planned: list[bool] = []
    seconds: list[float] = []
    while True:
        begun = time.process_time()
        learnt = session.learn()
        seconds.append(round(time.process_time() - begun, 3))
        curve.append(judge(trial.site, learnt.greedy).success)
        planned.append(_planned(trial.site, learnt, curve[-1]))
        if session.query is None or len(curve) > most:
            return curve, planned, seconds
        session.submit(trial.expert.answer(session.query))


def _planned(site: Site, learnt: Learned, otherwise: bool) -> bool:
    if learnt.keep_out is None:
        return otherwise
    return judge(site, plan(layout_of(site.grid), learnt.keep_out).greedy).success


def _at_once(site: Site, greedy: Callable[[], Ints]) -> WayOutcome:
    """Of a way that asks nothing."""
    begun = time.process_time()
    flown = greedy()
    seconds = round(time.process_time() - begun, 3)
    success = judge(site, flown).success
    return WayOutcome([success], [success], [], [seconds])


@lru_cache(maxsize=1)
def _compile() -> None:
    """Load what is compiled or slow to import, which is no part of a trial's time."""
    grid = Grid(1.0, 3, 3, (0.0, 0.0), 5.0, (2, 6))
    within_advise.compile_loops(grid)
    flight = demonstrate(grid, SimulatedPilot(grid, 0.0, 0.0, np.random.default_rng(0)), 0, 100)
    learn(grid, AS_PRINTED, (flight,), ())
