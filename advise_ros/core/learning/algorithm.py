"""ADVISE (algorithm 1) on any finite process: what is learnt from demonstrations and answers.

What is asked next is `core/questions/select.py`; `learner.py` does both on the drone's grid, `experiments` in the
domains of the paper.

Algorithm 1 imitates the most frequent action, also where a person makes the same mistake again and again, and puts an
answer in its place in every state that was asked about. With acquisition 'belief' it imitates the action that is
most likely the right one by all moves and all answers together (`core/advice/error_model.py`, `answer_beliefs.py`): an answer
about many states is then strong evidence about each of them, not the last word on every one. Where the moves do not leave it
beyond doubt that the person makes mistakes it imitates the most frequent action after all. With `site` it imitates what
follows from the belief about the site (`core/site/within_advise.py`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.advice.answer_beliefs import BELIEF, BY_WORTH, with_answers
from advise_ros.core.advice.error_model import log_beliefs, mistakes_shown, shares
from advise_ros.core.advice.state import AdviceState, Imitated, advice_state, narrowed
from advise_ros.core.demonstrations.demonstration import Counts
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.reward import Solve, infer
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.planning.process import FiniteProcess
from advise_ros.core.planning.rollout import distances
from advise_ros.core.questions.clusters import split
from advise_ros.core.questions.select import Situation
from advise_ros.core.site import SITE
from advise_ros.core.site.prior import NOTHING, SitePrior

if TYPE_CHECKING:
    from advise_ros.core.site.belief import SiteBelief

# Moves a state, on average, that beliefs need; with fewer, questions go where the policy does.
MOVES = 5.0
WITHOUT_BELIEFS = 'occupancy'
# Of the largest value that a reward can have, what the margins along the longest way add up to at most.
PART_OF_VALUES = 0.25
# An answer about several states is not followed in one whose right action is another one with this probability.
REFUTED = 0.9


def improve(  # noqa: PLR0913 - evidence and method
    process: FiniteProcess, settings: LearnSettings, counts: Counts, clusters: Ints, log: tuple[AdviceRecord, ...], solve: Solve,
    *, prior: SitePrior = NOTHING,
) -> Situation:
    """What is learnt after some answers.

    Args:
        process: what is to be done well.
        settings: constants and readings.
        counts: what was demonstrated, (n, n_actions).
        clusters: (n,) cluster of each state, -1 for states in which no action is chosen.
        log: accepted answers and retractions, in order.
        solve: finds an optimum of equation (1).
        prior: what was learnt of the site on other routes; for acquisition `site`.

    Raises:
        InputError: strict advice (slack_cost 0) that contradicts itself, or acquisition `site` without a grid.
    """
    settings = replace(settings, acquisition=in_effect(settings.acquisition, counts.visits[process.acting]))
    advice = advice_state(log, counts.taken if settings.confirms else None)
    imitated, belief = imitate(process, settings, counts, advice, prior)
    grid = process.grid if belief is not None else None
    inferred = infer(process.mdp, imitated, settings if grid is None else margins_in_range(grid, settings), solve)
    parts = split(process.features, clusters, advice.mixed, settings.seed, advice.drawn)
    return Situation(process, settings, counts, parts, advice, imitated, inferred, belief)


def margins_in_range(grid: Grid, settings: LearnSettings) -> LearnSettings:
    """The settings with margins that fit one after the other, along the longest way, into the values that rewards can make.

    Where every state has an action to imitate, larger margins cannot all hold, and the sum that equation (1) maximises gives
    some states up for others. Margins of advice are at most half of the cap, as in the defaults.

    Args:
        grid: the route.
        settings: their `margin_cap` and `delta` are upper bounds.
    """
    longest = max(1, int(distances(grid).max(axis=1).sum()))
    cap = PART_OF_VALUES * settings.r_max / (1.0 - settings.gamma) / longest
    cap = min(cap, settings.margin_cap) if settings.margin_cap > 0.0 else cap
    return replace(settings, margin_cap=cap, delta=min(settings.delta, cap / 2.0))


def in_effect(acquisition: str, visits: Ints) -> str:
    """The acquisition that decides: beliefs need enough moves.

    Args:
        acquisition: the one that is wished for.
        visits: (m,) demonstrated moves in each state in which an action is chosen.
    """
    few = visits.sum() < MOVES * len(visits)
    return WITHOUT_BELIEFS if acquisition in BY_WORTH and few else acquisition


def imitate(
    process: FiniteProcess, settings: LearnSettings, counts: Counts, advice: AdviceState, prior: SitePrior = NOTHING,
) -> tuple[Imitated, SiteBelief | None]:
    """What is imitated and what is advised, and with acquisition `site` what is believed of the site.

    Args:
        process: what is learnt; acquisition `site` takes one with a grid.
        settings: with the acquisition that decides, from `in_effect`.
        counts: what was demonstrated.
        advice: what was answered.
        prior: what was learnt of the site on other routes.

    Raises:
        InputError: acquisition `site` without a grid.
    """
    if settings.acquisition == SITE:
        if process.grid is None:
            raise InputError("acquisition 'site' is for routes on a grid; choose another for this process")
        from advise_ros.core.site import within_advise  # noqa: PLC0415 - compiled loops take half a second to import

        belief = within_advise.belief_of(process.grid, counts, advice, settings.seed, prior)
        return within_advise.imitate(process.grid, belief, advice, settings.slip), belief
    return imitated(settings.acquisition, counts, advice), None


def imitated(acquisition: str, counts: Counts, advice: AdviceState) -> Imitated:
    """The same in any process, by moves and answers alone.

    Args:
        acquisition: that decides, not `site`.
        counts: what was demonstrated.
        advice: what was answered.
    """
    standing = narrowed(advice.followed) if acquisition in BY_WORTH else advice.followed
    if acquisition == BELIEF and mistakes_shown(counts.taken):
        return _believed(counts, advice.followed, standing)
    return Imitated(counts.favourite(), standing)


def _believed(counts: Counts, held: tuple[AdviceRecord, ...], advice: tuple[AdviceRecord, ...]) -> Imitated:
    beliefs = shares(with_answers(log_beliefs(counts.taken), held))
    favourite = np.where(counts.visits > 0, beliefs.argmax(axis=1), -1)
    alone = {one.states[0] for one in held if len(one.states) == 1}
    return Imitated(favourite, tuple(left for one in advice if (left := _left(one, beliefs, favourite, alone)).states))


def _left(answer: AdviceRecord, beliefs: Floats, favourite: Ints, alone: set[int]) -> AdviceRecord:
    """The answer in the states where it says what is not imitated anyhow, and where nothing refutes it."""
    states = np.array(answer.states)
    agrees = np.isin(favourite[states], answer.preferred)
    together = np.array([state not in alone for state in answer.states])
    refuted: Bools = together & (favourite[states] >= 0) & (beliefs[states].max(axis=1) >= REFUTED)
    return replace(answer, states=tuple(states[~(agrees | refuted)].tolist()))
