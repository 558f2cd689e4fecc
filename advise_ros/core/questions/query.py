"""The question that was selected on the drone's grid, as the person gets it: a query in one or two plain sentences."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from advise_ros.core.advice.advice import AnswerOption, Meaning, Query
from advise_ros.core.advice.state import support
from advise_ros.core.grid.grid import N_ACTIONS, Action, Grid
from advise_ros.core.numerics import Ints
from advise_ros.core.planning.rollout import rollout
from advise_ros.core.questions.select import Question, Selection, Situation
from advise_ros.core.questions.uncertainty import cluster_uncertainty, sources
from advise_ros.core.site.wording import counted, listed, place, these, words

if TYPE_CHECKING:
    from advise_ros.core.site.questions import SiteQuestion


class Numbering(NamedTuple):
    """What the session counts: the policy's version, the next query's id and the budget (-1 unlimited)."""

    version: int
    query_id: int
    budget: int


class Asking(NamedTuple):
    """What is asked next.

    Attributes:
        query: the question, None when the budget is spent, no cluster is open or there is enough advice.
        doubt_left: what the best question that is open is worth, in `unit`.
        enough: it is worth less than `least`.
        least: what a question has to be worth to be asked, in `unit`; 0: anything.
        unit: by the acquisition in effect: steps that the answer saves (`site`), the share of the policy's visits that it is
            expected to correct (`gain`, `belief`), or how much demonstrations disagree where the policy goes [nat^2 a visit].
    """

    query: Query | None
    doubt_left: float
    enough: bool
    least: float
    unit: str


def next_query(grid: Grid, situation: Situation, numbering: Numbering) -> Asking:
    """SELECTQUERY, unless the budget is spent or there is enough advice.

    Args:
        grid: of the situation's process.
        situation: where the learner stands.
        numbering: of the query.
    """
    selection, spent = Selection(situation), situation.advice.budget_left(numbering.budget) == 0
    if not spent and situation.advice.doubtful is None and selection.is_enough:
        return Asking(None, selection.worth, True, selection.least, selection.unit)
    chosen = None if spent else selection.question()
    query = None if chosen is None else _query(grid, situation, chosen, numbering)
    return Asking(query, selection.worth, False, selection.least, selection.unit)


def _query(grid: Grid, situation: Situation, chosen: Question, numbering: Numbering) -> Query:
    states, inferred, unsure, settings = chosen.states, situation.inferred, situation.uncertainty, situation.settings
    only = np.where(np.isin(np.arange(grid.n_states), states), 0, -1)
    taken = situation.counts.taken
    disagreement, scarcity = (float(part.mean()) for part in sources(taken[states], settings.laplace))
    doubtful = situation.advice.doubtful if chosen.again else None
    asked = Asked(
        states, taken[states], inferred.greedy[states],
        (doubtful.preferred, *support(taken, doubtful)) if doubtful else None,
    )
    query = Query(
        query_id=numbering.query_id,
        policy_version=numbering.version,
        states=tuple(states.tolist()),
        uncertainty=float(cluster_uncertainty(only, unsure.state, settings.cluster_score)[0]),
        demonstration_uncertainty=float(unsure.demonstrations[states].mean()),
        policy_uncertainty=float(unsure.policy[states].mean()),
        demonstrated=tuple(situation.demonstrated[states].mean(axis=0).tolist()),
        policy=tuple(inferred.probabilities[states].mean(axis=0).tolist()),
        answered_before=tuple(sorted(situation.advice.advised.intersection(states.tolist()))),
        budget_left=situation.advice.budget_left(numbering.budget),
        question=question(grid, asked),
        disagreement=disagreement,
        scarcity=scarcity,
    )
    return query if chosen.of_site is None else _about_site(grid, situation, query, chosen.of_site)


def _about_site(grid: Grid, situation: Situation, query: Query, chosen: SiteQuestion) -> Query:
    """The query in words of what it decides, with an answer of one gesture for each way of it."""
    dispute = chosen.dispute
    if dispute is None:
        return replace(query, worth=chosen.worth)
    layer = grid.next_waypoint(chosen.states[0])
    way = rollout(grid, situation.inferred.greedy.tolist(), grid.start_state(), grid.n_states).states
    enters = any(grid.state(layer, cell) in way for cell in dispute.cells)
    said = words(grid, layer, dispute.cells, situation.counts.taken, enters=enters)
    options = (
        AnswerOption(Meaning.KEEP_OUT, *said.keep_out, *dispute.keep_out),
        AnswerOption(Meaning.FLY_THROUGH, *said.fly_through, *dispute.fly_through),
    )
    return replace(query, question=said.question, disputed=dispute.cells, options=options, worth=chosen.worth)


# -- the sentence -------------------------------------------------------------------------------------
class Asked(NamedTuple):
    """What the sentence is about.

    Attributes:
        states: (m,) ascending.
        taken: (m, n_actions) how often each action was taken there.
        greedy: (m,) what the drone would do.
        said: an earlier answer that the moves do not bear out: what it prefers, moves that way, all moves.
    """

    states: Ints
    taken: Ints
    greedy: Ints
    said: tuple[tuple[int, ...], int, int] | None = None


WAYS = ('', 'one way', 'two ways', 'three ways', 'four ways')
# A direction of fewer moves than this share is not named.
NAMED_SHARE = 0.1


def question(grid: Grid, asked: Asked) -> str:
    """The question in at most twelve words, then where it is, what was flown there and what the drone would fly.

    E.g. 'Flying to waypoint 2: which way in these 5 cells? Columns 2-4, rows 1-2; 39 moves there, split two ways: ...'.
    """
    cells, layers = asked.states % grid.n_cells, (np.unique(asked.states // grid.n_cells) + 1).tolist()
    to = _waypoints(layers) if len(layers) < 3 else 'several waypoints'
    where = place(grid, tuple(cells.tolist())).capitalize()
    if len(layers) > 2:
        where += f', on the way to {_waypoints(layers)}'
    short = f'Flying to {to}: which way in {these(len(asked.states))}?'
    reason = _doubted(*asked.said) if asked.said is not None else f'The drone would fly {_would(asked.greedy)}.'
    return f'{short} {where}; {_flown(asked.taken)}. {reason}'


def _doubted(preferred: tuple[int, ...], moves: int, of: int) -> str:
    said = ' or '.join(Action(action).name for action in preferred)
    way = 'ways' if len(preferred) > 1 else 'way'
    return f'You answered {said}, but {moves} of {of} moves there went that {way}, so it is asked once more.'


def _waypoints(layers: list[int]) -> str:
    if len(layers) == 1:
        return f'waypoint {layers[0]}'
    return f'waypoints {listed([str(layer) for layer in layers])}'


def _flown(taken: Ints) -> str:
    """E.g. '39 moves there, split two ways: EAST 60 %, NORTH 40 %'."""
    total = taken.sum(axis=0)
    if not total.any():
        return 'nobody flew there yet'
    shares = total / total.sum()
    ranked = [a for a in np.argsort(-shares, kind='stable') if shares[a] >= NAMED_SHARE]
    moves = f'{counted(int(total.sum()), "move")} there'
    if len(ranked) == 1:
        return f'{moves}, {"all" if shares[ranked[0]] == 1.0 else "nearly all"} {Action(ranked[0]).name}'
    return f'{moves}, split {WAYS[len(ranked)]}: ' + ', '.join(f'{Action(a).name} {100 * shares[a]:.0f} %' for a in ranked)


def _would(greedy: Ints) -> str:
    """Directions in the order of how many states have them."""
    counts = np.bincount(greedy, minlength=N_ACTIONS)
    ranked = [Action(a).name for a in np.argsort(-counts, kind='stable') if counts[a]]
    return ranked[0] if len(ranked) == 1 else f'{ranked[0]}, in some cells {" or ".join(ranked[1:])}'
