"""One trial of section 4 on the grid model: noisy flights, a first policy, answers, a better policy."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from advise_ros.core.advice.advice import AdviceRecord, active
from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.flight.flight_settings import FlightSettings
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.learner import Learned, learn
from advise_ros.core.learning.session import Session
from advise_ros.core.people.settings import ExpertSettings, PilotSettings
from advise_ros.core.people.simulated_expert import SimulatedExpert
from advise_ros.core.people.simulated_pilot import SimulatedPilot, demonstrate
from advise_ros.core.planning.rollout import rollout, step_budget


@dataclass(frozen=True)
class TrialSettings:
    """Pilot, learner and expert of a trial.

    Attributes:
        learn: the learner's settings; its seed is replaced by the trial's.
        flights: demonstrations.
        answers: queries that the expert answers.
        noise_rate, mistake_share, max_moves: of the `SimulatedPilot`.
        prefer, avoid, error_rate, skip_rate: of the `SimulatedExpert`.
        step_budget_factor: moves that a policy may take, times the shortest route.
    """

    learn: LearnSettings = field(default_factory=LearnSettings)
    flights: int = 4
    answers: int = 10
    noise_rate: float = PilotSettings.noise_rate
    mistake_share: float = PilotSettings.mistake_share
    max_moves: int = PilotSettings.max_moves
    prefer: str = ExpertSettings.prefer
    avoid: str = ExpertSettings.avoid
    error_rate: float = ExpertSettings.error_rate
    skip_rate: float = ExpertSettings.skip_rate
    step_budget_factor: float = FlightSettings.step_budget_factor


class TrialResult(NamedTuple):
    """What came of a trial.

    Attributes:
        seed: of every random choice.
        before, after: whether the policy reached the goal in order, without and with advice.
        answers: given by the expert.
        moves: over all demonstrations.
        curve: success after 0, 1, ... answers; of an `advised_trial` after none and after all.
    """

    seed: int
    before: bool
    after: bool
    answers: int
    moves: int
    curve: tuple[bool, ...]


def run_trial(grid: Grid, settings: TrialSettings, seed: int) -> TrialResult:
    """One seeded trial."""
    rng = np.random.default_rng(seed)
    demonstrations = fly(grid, settings, rng)
    curve = follow(grid, settings, demonstrations, rng, seed)
    moves = sum(len(demonstration.states) for demonstration in demonstrations)
    return TrialResult(seed, curve[0], curve[-1], len(curve) - 1, moves, curve)


def advised_trial(grid: Grid, settings: TrialSettings, log: tuple[AdviceRecord, ...], seed: int) -> TrialResult:
    """The demonstrations of one seed, with answers that were given in another session.

    Args:
        grid: the route.
        settings: of pilot and learner.
        log: the answers, all of them or none.
        seed: of the pilot and the learner.
    """
    demonstrations = fly(grid, settings, np.random.default_rng(seed))
    learn_settings = replace(settings.learn, seed=seed)
    curve = tuple(_succeeds(grid, settings, learn(grid, learn_settings, demonstrations, told)) for told in ((), log))
    moves = sum(len(demonstration.states) for demonstration in demonstrations)
    return TrialResult(seed, curve[0], curve[-1], len(active(log)), moves, curve)


def follow(
    grid: Grid, settings: TrialSettings, demonstrations: tuple[Demonstration, ...], rng: np.random.Generator, seed: int,
) -> tuple[bool, ...]:
    """Whether the policy reaches the goal in order after 0, 1, ... answers of the expert.

    Args:
        grid: the route.
        settings: of learner and expert.
        demonstrations: what is learnt from, simulated or real.
        rng: of the expert.
        seed: of the learner.
    """
    session = Session(grid, replace(settings.learn, seed=seed), settings.answers)
    for demonstration in demonstrations:
        session.add(demonstration)
    expert = SimulatedExpert(
        grid, rng, settings.avoid, settings.error_rate, settings.skip_rate, prefer=settings.prefer
    )
    curve = [_succeeds(grid, settings, _learn(session))]
    while session.query is not None and len(curve) <= settings.answers:
        session.submit(expert.answer(session.query))
        curve.append(_succeeds(grid, settings, _learn(session)))
    return tuple(curve)


def fly(grid: Grid, settings: TrialSettings, rng: np.random.Generator) -> tuple[Demonstration, ...]:
    """The demonstrations of one simulated pilot."""
    pilot = SimulatedPilot(grid, settings.noise_rate, settings.mistake_share, rng)
    return tuple(demonstrate(grid, pilot, index, settings.max_moves) for index in range(settings.flights))


def _learn(session: Session) -> Learned:
    work = session.snapshot()
    if work is None:
        raise AssertionError('a new answer must lead to a new policy')
    learned = work.run()
    session.adopt(learned)
    return learned


def _succeeds(grid: Grid, settings: TrialSettings, learned: Learned) -> bool:
    start = grid.start_state()
    budget = step_budget(grid, start, settings.step_budget_factor)
    return rollout(grid, learned.greedy.tolist(), start, budget).reached
