"""One trial of section 4 on the grid model: noisy flights, a first policy, answers, a better policy, another route."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.advice.advice import AdviceRecord, active
from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.flight.flight_settings import FlightSettings
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.learner import Learned, kept_of, learn
from advise_ros.core.learning.session import Session
from advise_ros.core.people.known_site import Judgement, Site, judge, site_of
from advise_ros.core.people.settings import ExpertSettings, PilotSettings
from advise_ros.core.people.simulated_expert import SimulatedExpert
from advise_ros.core.people.simulated_pilot import SimulatedPilot, demonstrate


@dataclass(frozen=True)
class TrialSettings:
    """Pilot, learner and expert of a trial.

    Attributes:
        learn: the learner's settings; its seed is replaced by the trial's.
        flights: demonstrations.
        answers: queries that the expert answers.
        noise_rate, mistake_share, max_moves: of the `SimulatedPilot`.
        prefer, avoid, error_rate, skip_rate: of the `SimulatedExpert`.
        step_budget_factor: moves that a policy may take, times the best route.
        keep_out: cells that the person wants kept out of.
        other: another route over the same site, flown in the end by what was learnt of it.
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
    keep_out: tuple[int, ...] = ()
    other: Grid | None = None


class TrialResult(NamedTuple):
    """What came of a trial.

    Attributes:
        seed: of every random choice.
        answers: given by the expert.
        moves: over all demonstrations.
        curve: what the policy is worth after 0, 1, ... answers; of an `advised_trial` after none and after all.
        other: what is flown of the settings' other route is worth, None without one.
    """

    seed: int
    answers: int
    moves: int
    curve: tuple[Judgement, ...]
    other: Judgement | None

    @property
    def before(self) -> Judgement:
        return self.curve[0]

    @property
    def after(self) -> Judgement:
        return self.curve[-1]


def run_trial(grid: Grid, settings: TrialSettings, seed: int) -> TrialResult:
    """One seeded trial."""
    rng = np.random.default_rng(seed)
    demonstrations = fly(grid, settings, rng)
    learned, log = zip(*interview(grid, settings, demonstrations, rng, seed), strict=True)
    return _result(grid, settings, demonstrations, learned, log[-1])


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
    learned = tuple(learn(grid, learn_settings, demonstrations, answers) for answers in ((), log))
    return _result(grid, settings, demonstrations, learned, log)


def _result(
    grid: Grid, settings: TrialSettings, demonstrations: tuple[Demonstration, ...], learned: tuple[Learned, ...],
    log: tuple[AdviceRecord, ...],
) -> TrialResult:
    site = site_of(grid, settings.keep_out)
    curve = tuple(_judged(site, settings, one.greedy) for one in learned)
    moves = sum(len(demonstration.states) for demonstration in demonstrations)
    other = other_flight(settings, demonstrations, log, learned[-1])
    return TrialResult(learned[0].settings.seed, len(active(log)), moves, curve, other)


def follow(
    grid: Grid, settings: TrialSettings, demonstrations: tuple[Demonstration, ...], rng: np.random.Generator, seed: int,
) -> tuple[bool, ...]:
    """Whether the policy succeeds after 0, 1, ... answers of the expert; arguments as of `interview`."""
    site = site_of(grid, settings.keep_out)
    return tuple(
        _judged(site, settings, learned.greedy).success for learned, _ in interview(grid, settings, demonstrations, rng, seed)
    )


def interview(
    grid: Grid, settings: TrialSettings, demonstrations: tuple[Demonstration, ...], rng: np.random.Generator, seed: int,
) -> Iterator[tuple[Learned, tuple[AdviceRecord, ...]]]:
    """What is learnt from demonstrations, and after each answer of the expert, with the log of that time.

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
        grid, rng, settings.avoid, settings.error_rate, settings.skip_rate, prefer=settings.prefer,
        right=site_of(grid, settings.keep_out).right,
    )
    yield session.learn(), session.log
    for _ in range(settings.answers):
        if session.query is None:
            break
        session.submit(expert.answer(session.query))
        yield session.learn(), session.log


def other_flight(
    settings: TrialSettings, demonstrations: tuple[Demonstration, ...], log: tuple[AdviceRecord, ...], learned: Learned,
) -> Judgement | None:
    """What is learnt for the other route from what was kept of the site is worth; None without such a route.

    Args:
        settings: of the trial.
        demonstrations, log: of the first route.
        learned: the last that was learnt from these.
    """
    if settings.other is None or learned.keep_out is None:
        return None
    kept = kept_of(learned.grid, demonstrations, log)
    elsewhere = learn(settings.other, learned.settings, (), (), prior=kept)
    return _judged(site_of(settings.other, settings.keep_out), settings, elsewhere.greedy)


def fly(grid: Grid, settings: TrialSettings, rng: np.random.Generator) -> tuple[Demonstration, ...]:
    """The demonstrations of one simulated pilot."""
    right = site_of(grid, settings.keep_out).right
    pilot = SimulatedPilot(grid, settings.noise_rate, settings.mistake_share, rng, right=right)
    return tuple(demonstrate(grid, pilot, index, settings.max_moves) for index in range(settings.flights))


def _judged(site: Site, settings: TrialSettings, greedy: npt.NDArray[np.integer]) -> Judgement:
    return judge(site, greedy, settings.step_budget_factor)
