"""What to ask next: the few cells of a way whose answer is expected to save most, and whether anything is worth asking at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.site.belief import SiteBelief, spread
from advise_ros.core.site.chain import answer_code
from advise_ros.core.site.compiled import compiled
from advise_ros.core.site.dispute import MOST_CELLS, Dispute, dispute_of
from advise_ros.core.site.layout import Bytes, Int32s, Layout
from advise_ros.core.site.pilots import best_sets
from advise_ros.core.site.plan import highest, least_steps, lowest, plan, route

# Pieces of ways have so many cells, or run to the next turn.
PIECES = (2, 3, 4, 6)
# Maps whose ways are cut into pieces, and pieces that are looked at closely.
MAPS_FLOWN, MOST_CANDIDATES = 30, 400
# What was asked before is worth a little less, and so is each further cell.
ASKED_BEFORE, PER_CELL = 0.9, 1e-3
# A person grasps a few cells more easily than one: of pieces that tell the same, so many cells are asked about.
GRASPED = 3


class SiteQuestion(NamedTuple):
    """A question about states of one layer that lie on one way.

    Attributes:
        states: ascending.
        worth: steps that the answer is expected to save.
        dispute: what the answer decides, None where no cell goes with it.
    """

    states: tuple[int, ...]
    worth: float
    dispute: Dispute | None = None


def next_question(
    layout: Layout, belief: SiteBelief, rng: np.random.Generator, unwanted: frozenset[tuple[int, ...]] = frozenset(),
) -> SiteQuestion | None:
    """The question that is worth most; None when no answer would change what is believed.

    Args:
        layout: the site and the route.
        belief: what is believed of it.
        rng: of the choice of maps and candidates, where there are many.
        unwanted: states of questions that the person does not want to hear again, nor others that tell the same.
    """
    asking = _asking(belief)
    sets = best_sets(layout, asking)
    differs = (sets != sets[0]).any(axis=0)
    refused = {_answers(sets, piece).tobytes() for piece in unwanted}
    pieces = [piece for piece in _candidates(layout, belief, asking, sets, rng) if differs[list(piece)].any()]
    if len(pieces) > MOST_CANDIDATES:
        pieces = [pieces[at] for at in np.sort(rng.choice(len(pieces), MOST_CANDIDATES, replace=False))]
    answers = {piece: _answers(sets, piece) for piece in pieces}
    candidates = {piece: told for piece, told in answers.items() if told.tobytes() not in refused}
    worths = _worths(layout, asking, candidates, {one.states for one in belief.answers})
    if not len(worths) or worths.max() <= 0.0:
        return None
    pieces = list(candidates)
    chosen = grasped(sets, pieces, pieces[int(worths.argmax())])
    codes = _codes(sets, np.array(chosen, dtype=np.int32))
    return SiteQuestion(chosen, float(worths.max()), dispute_of(layout, asking, codes))


def _asking(belief: SiteBelief) -> Bytes:
    """(about 100, ...) maps, those that doubt the moves in proportion to that doubt."""
    doubting = round(belief.doubt * len(belief.maps))
    return np.concatenate([spread(belief.maps, len(belief.maps) - doubting), spread(belief.doubting, doubting)])


def grasped(sets: Bytes, candidates: Sequence[tuple[int, ...]], best: tuple[int, ...]) -> tuple[int, ...]:
    """Of the pieces around the best one that tell the same, one that is nearest to GRASPED cells."""
    told, inside = _answers(sets, best), set(best)
    around = [piece for piece in candidates if inside <= set(piece)]
    alike = [piece for piece in around if np.array_equal(_answers(sets, piece), told)]
    return min(alike, key=lambda piece: abs(len(piece) - GRASPED))


def _candidates(
    layout: Layout, belief: SiteBelief, asking: Bytes, sets: Bytes, rng: np.random.Generator,
) -> list[tuple[int, ...]]:
    """Single states and straight pieces of ways that are believed possible, in order."""
    rows = np.sort(np.unique(asking, axis=0, return_index=True)[1])
    if len(rows) > MAPS_FLOWN:
        rows = np.sort(rng.choice(rows, MAPS_FLOWN, replace=False))
    ways = [plan(layout, belief.expected).greedy, *lowest(sets[rows]), *highest(sets[rows[:10]])]
    pieces: dict[tuple[int, ...], None] = {}
    for greedy in ways:
        for run in _straight(layout, route(layout, greedy), greedy):
            for size in {1, *PIECES, min(len(run), MOST_CELLS)}:
                pieces.update(dict.fromkeys(tuple(sorted(run[at : at + size])) for at in range(len(run) - size + 1)))
    return sorted(pieces, key=lambda piece: (len(piece), piece))


def _straight(layout: Layout, states: list[int], greedy: Ints) -> list[list[int]]:
    """A way cut where it turns or a waypoint is reached."""
    runs: list[list[int]] = []
    for state in states:
        last = runs[-1][-1] if runs else -1
        if runs and greedy[state] == greedy[last] and state // layout.n_cells == last // layout.n_cells:
            runs[-1].append(state)
        else:
            runs.append([state])
    return runs


def _worths(
    layout: Layout, asking: Bytes, candidates: Mapping[tuple[int, ...], Ints], asked: set[tuple[int, ...]],
) -> Floats:
    """(m,) steps that the answer to each candidate is expected to save."""
    if not candidates:
        return np.zeros(0)
    now = float(least_steps(layout, asking.mean(axis=0)[None])[0])
    saved: dict[bytes, float] = {}
    for told in candidates.values():
        if told.tobytes() not in saved:
            saved[told.tobytes()] = now - _steps_after(layout, asking, told) if told.any() else 0.0
    again = np.array([ASKED_BEFORE if _nested(set(piece), asked) else 1.0 for piece in candidates])
    sizes = np.array([len(piece) for piece in candidates])
    worths: Floats = np.array([saved[told.tobytes()] for told in candidates.values()]) * again - PER_CELL * sizes
    return worths


def _nested(piece: set[int], asked: set[tuple[int, ...]]) -> bool:
    """Whether it is part of what was asked before, or the other way round."""
    return any(piece <= set(one) or piece >= set(one) for one in asked)


def _answers(sets: Bytes, piece: tuple[int, ...]) -> Ints:
    """(maps,) the number of the answer under each map, from 0."""
    codes = _codes(sets, np.array(piece, dtype=np.int32))
    numbers: Ints = np.unique(codes, return_inverse=True)[1].ravel()
    return numbers


def _steps_after(layout: Layout, asking: Bytes, answers: Ints) -> float:
    """Expected cost of the route when the answer is known; (maps,) its number under each map."""
    means = np.array([asking[answers == number].mean(axis=0) for number in range(answers.max() + 1)])
    return float((np.bincount(answers) / len(answers)) @ least_steps(layout, means))


@compiled
def _codes(sets: Bytes, states: Int32s) -> Ints:
    """(maps,) the answer under each map, as 16 * preferred + avoided."""
    codes = np.empty(len(sets), np.int64)
    for row in range(len(sets)):
        preferred, avoided = answer_code(sets[row], states, 0, len(states))
        codes[row] = 16 * preferred + avoided
    return codes
