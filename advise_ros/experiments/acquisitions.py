"""Fewer questions: ways to ask beside the paper's, with experts who are right and who err, and when to stop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from advise_ros.core.advice.answer_beliefs import BY_WORTH
from advise_ros.core.numerics import Floats
from advise_ros.domains.domain import Domain
from advise_ros.experiments.figures import Trials
from advise_ros.experiments.interview import Interview, with_errors
from advise_ros.experiments.method import Protocol, Variant
from advise_ros.experiments.statistics import estimate
from advise_ros.experiments.store import Store, key_of

ABOUT = 'ways to ask: answers needed, the whole curve, errors of the expert, and when to stop'
ERRORS = (0.0, 0.1, 0.2)
# Share of the performance with all ideal clusters advised that counts as learnt.
LEARNT = 0.95
# The stopping rule tested: doubt_left below this (parameter `enough`); its unit depends on what decides the questions.
ENOUGH, ENOUGH_GAIN = 0.03, 0.02
# Performance this near to the best of a trial is as good, as a share of it; stopping so many questions off is on time.
AS_GOOD, ON_TIME = 0.01, 2

IDEAL = Variant('ideal', clustering='ideal', acquisition='disagreement', temperature=0.1)
PAPER = Variant('paper')
GAINS = Variant('gain', acquisition='gain', temperature=0.1, confirm=True)
BELIEFS = Variant('belief', acquisition='belief', temperature=0.1, confirm=True)
VARIANTS = (IDEAL, PAPER, GAINS, BELIEFS)


class Row(NamedTuple):
    """One variant in one domain with one kind of expert.

    Attributes:
        error_rate: of the expert.
        answers: questions until the mean performance reaches LEARNT of the ideal one, None: not within the budget.
        area: mean performance over 1 to 10 questions, with the half width of its interval.
        curve, ci95: mean performance after 0, 1, ... questions, with half widths.
        best_stop: questions after which a trial is as good as it gets, on average.
        stopped: questions after which the rule stops, on average.
        on_time: share of the trials in which these are at most ON_TIME apart.
        regret: performance given up by stopping there, on average, against the end of the budget.
    """

    domain: str
    method: str
    error_rate: float
    trials: int
    answers: int | None
    area: float
    area_ci95: float
    curve: tuple[float, ...]
    ci95: tuple[float, ...]
    best_stop: float
    stopped: float
    on_time: float
    regret: float


def rows(store: Store, domain: Domain, protocol: Protocol, trials: Trials) -> list[Row]:
    """Every variant with every kind of expert, from stored trials."""
    learnt = _stored(store, with_errors(protocol, 0.0), IDEAL, trials)
    ideal = float(np.mean([one.performance[-1] for one in learnt]))
    return [
        row(domain, variant, rate, _stored(store, with_errors(protocol, rate), variant, trials), ideal)
        for rate in ERRORS for variant in VARIANTS
    ]


def _stored(store: Store, protocol: Protocol, variant: Variant, trials: Trials) -> list[Interview]:
    key = key_of('interview', protocol, variant)
    return [Interview(*map(tuple, store[key, seed])) for seed in trials.seeds]


def row(domain: Domain, variant: Variant, error_rate: float, found: Sequence[Interview], ideal: float) -> Row:
    """The summary of a variant's trials.

    Args:
        domain: of the trials.
        variant: what was tried.
        error_rate: of the expert.
        found: trials.
        ideal: mean performance with all ideal clusters advised by an expert who is right.
    """
    curves = np.array([one.performance for one in found])
    points = [estimate(column) for column in curves.T]
    area = estimate(curves[:, 1:].mean(axis=1))
    means = np.array([point.mean for point in points])
    sign = 1.0 if domain.measure.higher_is_better else -1.0
    best = np.array([_best_stop(sign * curve) for curve in curves])
    stopped = np.array([_stops(one.doubt, variant) for one in found])
    given_up = sign * (curves[:, -1] - curves[np.arange(len(curves)), stopped])
    return Row(
        domain.name, variant.name, error_rate, len(found), _answers(domain, means, ideal), area.mean, area.ci95,
        tuple(means.tolist()), tuple(point.ci95 for point in points), float(best.mean()), float(stopped.mean()),
        float((np.abs(best - stopped) <= ON_TIME).mean()), float(given_up.mean()),
    )


def _answers(domain: Domain, means: Floats, ideal: float) -> int | None:
    """Fewest questions that make LEARNT of the ideal; a wait may be that much longer."""
    learnt = means >= LEARNT * ideal if domain.measure.higher_is_better else means <= ideal / LEARNT
    return int(learnt.argmax()) if learnt.any() else None


def _best_stop(curve: Floats) -> int:
    """Fewest questions after which nothing better comes; more is better."""
    return int((curve >= curve.max() - AS_GOOD * abs(curve.max())).argmax())


def _stops(doubts: Sequence[float], variant: Variant) -> int:
    """Questions after which the rule stops."""
    low = np.array(doubts) < (ENOUGH_GAIN if variant.acquisition in BY_WORTH else ENOUGH)
    return int(low.argmax()) if low.any() else len(doubts) - 1


def table(rows: Sequence[Row]) -> str:
    """Markdown: a line a variant, domain and kind of expert."""
    lines = ['| domain | errors | method | answers to 95 % | mean of 1-10 | stops after (best) | on time | given up |']
    lines.append('| --- ' * 8 + '|')
    for one in rows:
        answers = '> 10' if one.answers is None else str(one.answers)
        lines.append(
            f'| {one.domain} | {one.error_rate:.0%} | {one.method} | {answers} | {one.area:.2f} ± {one.area_ci95:.2f} '
            f'| {one.stopped:.1f} ({one.best_stop:.1f}) | {one.on_time:.0%} | {one.regret:.2f} |'
        )
    return '\n'.join(lines) + '\n'
