"""The belief about a site as part of algorithm 1: which actions are imitated, and what is asked next.

PARSEDEM takes the believed action of every state, flown or not, for a*; STATECLUSTERING and SELECTQUERY are the pieces of
ways of `questions` and what their answers are expected to save; equation (1) and the advice stay as they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from advise_ros.core.advice.advice import AdviceRecord, Verdict
from advise_ros.core.advice.state import AdviceState, Imitated, advice_state
from advise_ros.core.demonstrations.demonstration import Counts, Demonstration, count
from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.numerics import Ints
from advise_ros.core.site.agreement import FEWEST_FLIGHTS, two_people
from advise_ros.core.site.belief import SiteAnswer, SiteBelief, believe, tell
from advise_ros.core.site.keep import evidence_of
from advise_ros.core.site.layout import layout_of
from advise_ros.core.site.plan import first_of, plan
from advise_ros.core.site.prior import NOTHING, SitePrior, answers_of
from advise_ros.core.site.questions import SiteQuestion, next_question


def belief_of(grid: Grid, counts: Counts, advice: AdviceState, seed: int, prior: SitePrior = NOTHING) -> SiteBelief:
    """What flights and the answers that hold say of the site, beside what was learnt of it before; of these alone.

    Args:
        grid: the site and the route.
        counts: what was flown.
        advice: what was answered.
        seed: of every random choice.
        prior: what was learnt on other routes.
    """
    answers = _answers(advice)
    belief = _remembered(BeliefKey(grid, counts.taken.astype(np.int64).tobytes(), seed, prior), answers)
    # Answers and layers of this route, which are the last: their states are its own.
    maps, doubting = (each if each.ndim == 2 else each[:, -grid.n_layers :] for each in (belief.maps, belief.doubting))
    expected = belief.expected if belief.expected.ndim == 1 else belief.expected[-grid.n_layers :]
    return replace(belief, maps=maps, expected=expected, doubting=doubting, answers=answers)


class BeliefKey(NamedTuple):
    """What a belief begins with: grid, moves (states, 4) as bytes, seed, what was learnt before."""

    grid: Grid
    taken: bytes
    seed: int
    prior: SitePrior


@lru_cache(maxsize=16)
def _remembered(known: BeliefKey, answers: tuple[SiteAnswer, ...]) -> SiteBelief:
    """One more answer costs one more drawing of maps, not all of them again."""
    evidence, rng = evidence_of(known.grid, known.prior), np.random.default_rng([known.seed, len(answers)])
    if not answers:
        taken = np.concatenate([evidence.taken, np.frombuffer(known.taken, dtype=np.int64).reshape(-1, 4)])
        return believe(evidence.layout, taken, evidence.answers, rng, cell_price=evidence.cell_price)
    last = answers[-1]._replace(states=tuple(evidence.earlier + state for state in answers[-1].states))
    return tell(evidence.layout, _remembered(known, answers[:-1]), last, rng, cell_price=evidence.cell_price)


def _answers(advice: AdviceState) -> tuple[SiteAnswer, ...]:
    return tuple(SiteAnswer(one.states, one.preferred, one.avoided) for one in answers_of(advice))


def two_people_in_words(
    grid: Grid, flights: Sequence[Demonstration], seed: int, prior: SitePrior = NOTHING,
) -> str:
    """Which of the flights look like those of a person with other wishes, in one sentence; '' if none do.

    Args:
        grid: the site and the route.
        flights: at least FEWEST_FLIGHTS, or nothing is said.
        seed: of every random choice.
        prior: what was learnt on other routes.
    """
    if len(flights) < FEWEST_FLIGHTS:
        return ''
    belief = belief_of(grid, count(grid, flights), advice_state(()), seed, prior)
    rng, layout = np.random.default_rng([seed, 2]), layout_of(grid)
    found = two_people(layout, [count(grid, [flight]).taken for flight in flights], belief, rng)
    return '' if found is None else found.sentence(layout, [flight.demonstration_id for flight in flights])


def imitate(grid: Grid, belief: SiteBelief, advice: AdviceState, slip: float = 0.0) -> Imitated:
    """The believed action of every state, and the advice as far as the belief bears it out.

    An answer that all else speaks against is outvoted in the belief already; a row of the program would bring it back. And an
    answer about several states prefers what is right in most of them: in each it stands for what is believed right there.

    Args:
        grid: the site and the route.
        belief: what is believed of it.
        advice: what was answered.
        slip: probability that wind makes another move than the one chosen.
    """
    layout = layout_of(grid)
    way = plan(layout, belief.expected, slip)
    favourite = np.where((layout.acting > 0) & (way.best > 0), way.greedy, -1)
    right = np.where(favourite >= 0, way.best, 0)
    return Imitated(favourite, tuple(part for record in advice.followed for part in _borne_out(record, right)))


def _borne_out(record: AdviceRecord, right: Ints) -> Iterator[AdviceRecord]:
    """The answer state by state: the action that is flown of those it prefers and that are believed right, over all others.

    An advised state has no other rows in the program: the answer's own avoided directions alone would leave the rest open.
    Which of several right actions is worth most has to be said everywhere, or the values of the rest do not fit together.

    Args:
        record: the answer.
        right: (states,) what is believed right, as sums of 1 << action.
    """
    preferred = sum(1 << action for action in record.preferred)
    for state in record.states:
        borne_out = int(right[state]) & preferred
        if borne_out:
            flown = int(first_of(np.array(borne_out, dtype=np.uint8)))
            yield replace(record, states=(state,), preferred=(flown,), avoided=tuple(set(range(N_ACTIONS)) - {flown}))


def ask(grid: Grid, belief: SiteBelief, advice: AdviceState, seed: int) -> SiteQuestion | None:
    """The question that is worth most, but for those that the person did not want to answer."""
    unwanted = frozenset(
        record.states for record in advice.active
        if record.verdict in (Verdict.SKIP, Verdict.UNSURE) or (record.verdict is Verdict.MIXED and len(record.states) > 1)
    )
    rng = np.random.default_rng([seed, len(advice.log), 1])
    return next_question(layout_of(grid), belief, rng, unwanted)


def compile_loops(grid: Grid) -> None:
    """Use every compiled loop once, on any small grid, so that its machine code is kept on disk."""
    counts = Counts(np.ones((grid.n_states, 4), dtype=np.int64))
    nothing = advice_state(())
    belief = belief_of(grid, counts, nothing, 0)
    ask(grid, belief, nothing, 0)
    imitate(grid, tell(layout_of(grid), belief, SiteAnswer((0,), (0,), (2,)), np.random.default_rng(0)), nothing, slip=0.1)
