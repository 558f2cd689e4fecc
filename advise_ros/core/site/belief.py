"""What is believed of a site after flights and answers: maps of cells to keep out of, drawn as often as they are likely."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.site.chain import CompiledAnswers, Problem, log_answers
from advise_ros.core.site.layout import Bytes, Layout
from advise_ros.core.site.marginals import level_probabilities
from advise_ros.core.site.pilots import PILOTS, Moves, Pilot, best_sets, moves_of, rounded
from advise_ros.core.site.plan import barred
from advise_ros.core.site.tempering import TEMPERATURES, Draws, draw
from advise_ros.core.site.wishes import ALIKE, GRADED, KEEP_OUT, Wishes

MapsT = TypeVar('MapsT', bound=npt.NDArray[Any])
# An answer is right with this probability; a right one calls each action otherwise than the map with the other; a wrong one is
# one of so many.
RIGHT, OTHERWISE, WRONG_ANSWERS = 0.9, 0.1, 30
# Maps with a price [nat] a marked cell and an edge of their border: few cells, and those together.
CELL_PRICE, EDGE_PRICE = 0.8, 0.4
# Models of the pilot that explain the moves worse by more than this [nat] are dropped.
HOPELESSLY_BEHIND = 15.0
# Evidence differs by a few nat from one drawing to the next: odds between models are taken that much less seriously.
FLATTER = 2.0
# Log odds against a richer kind of wishes, before anything was seen. It is looked at closely, and the pilot fitted to it, if
# it is not further behind than this after a first drawing [nat].
RICHER_ODDS, UNPROMISING = 7.0, 6.0
# Before any answer, the moves are doubted with this probability when questions are weighed.
DOUBT = 0.5
# Maps drawn before an answer are kept if those that go with it are at least this share (effective sample size).
LEAST_SUPPORT = 0.1
# Answers that the maps fit worse than this [nat] say that there may be a richer wish.
CONTRADICTED = -2.0
# The models of the pilot are fitted to the moves so often, and the maps drawn anew; before each fit those are dropped that are
# behind by more than this [nat]: a fit makes up for less.
BEHIND_BEFORE_FIT = (150.0, 30.0)
# Maps by which each cell's probability is worked out, given all other cells.
MARGINAL_MAPS = 10
# How much shorter the drawings before the last fit are: they only have to find a map to fit to.
EARLY = 0.5


@dataclass(frozen=True)
class SamplerSettings:
    """How long is searched.

    Attributes:
        steps_per_cell, least_steps: proposals a model of the pilot, each time that maps are drawn.
        last_per_cell, last_least: the same after the last fit, before anything was answered: all later maps begin with these.
        maps: maps that a belief holds.
        richer: kinds of wishes beside cells to keep out of that are looked for in the flights.
        contradicted: kinds that are looked for when the maps contradict an answer; no measurement says yet that it pays.
    """

    steps_per_cell: int = 25
    least_steps: int = 8_000
    last_per_cell: int = 75
    last_least: int = 16_000
    maps: int = 100
    richer: tuple[Wishes, ...] = (GRADED,)
    contradicted: tuple[Wishes, ...] = ()

    def steps(self, layout: Layout) -> int:
        """Proposals for a site."""
        return max(self.least_steps, self.steps_per_cell * layout.n_cells)

    def early_steps(self, layout: Layout) -> int:
        """Before the last fit."""
        return round(EARLY * self.steps(layout))

    def last_steps(self, layout: Layout) -> int:
        """After the last fit."""
        return max(self.last_least, self.last_per_cell * layout.n_cells)


class SiteAnswer(NamedTuple):
    """What a person said is right and wrong in some states; both empty where all is right."""

    states: tuple[int, ...]
    preferred: tuple[int, ...]
    avoided: tuple[int, ...]


class PilotBelief(NamedTuple):
    """One model of the pilot, fitted to the moves, and the maps that explain them under it and one kind of wishes.

    Attributes:
        weight: of the model among all, by its evidence.
    """

    pilot: Pilot
    weight: float
    draws: Draws
    wishes: Wishes = ALIKE

    @property
    def evidence(self) -> float:
        """Log of the fractional Bayes factor [nat]: how much likelier the whole likelihood of the moves is than the part of it
        that the hottest copy weighs (O'Hagan 1995), integrated over the temperatures; the fit of the answers; the odds against
        richer wishes."""
        moves = -np.trapezoid(self.draws.fit, 1.0 / np.array(TEMPERATURES))
        return float(rounded(np.asarray(moves + self.draws.answers), 20)) - (RICHER_ODDS if self.wishes != ALIKE else 0.0)


@dataclass(frozen=True, eq=False)
class SiteBelief:
    """What is believed of a site.

    Attributes:
        maps: (k, cells) 1 for cells to keep out of, equally likely. With richer kinds of wishes what entering a cell costs in
            what entering one to keep out of does; (k, layers, cells) if that depends on the waypoint.
        expected: (cells,) or (layers, cells) what entering each cell is expected to cost in the same measure: what a plan goes
            by.
        keep_out: (cells,) probability that the person wants the cell kept out of, on the way to one waypoint at least.
        doubting: (m, cells) or (m, layers, cells) maps that lie half-way to doubting the moves; for questions.
        doubt: probability that the moves are to be doubted so, after the answers.
        pilots: models of the pilot that explain the moves, the likeliest first.
        answers: what was said.
        flights: the moves.
    """

    maps: Bytes | Floats
    expected: Floats
    keep_out: Floats
    doubting: Bytes | Floats
    pilots: tuple[PilotBelief, ...]
    answers: tuple[SiteAnswer, ...]
    flights: Moves
    doubt: float = DOUBT


def believe(
    layout: Layout, taken: Ints, answers: tuple[SiteAnswer, ...], rng: np.random.Generator,
    settings: SamplerSettings | None = None, cell_price: Floats | None = None,
) -> SiteBelief:
    """What moves and answers say of a site, the answers one after the other.

    Args:
        layout: the site and the route.
        taken: (states, 4) moves flown.
        answers: in the order in which they were given.
        rng: of every random choice.
        settings: how long is searched.
        cell_price: (cells,) log odds against each cell before anything was seen [nat]; None: CELL_PRICE each.
    """
    settings = settings or SamplerSettings()
    prices = _prices(layout, cell_price)
    belief = _first(layout, moves_of(layout, taken), prices, settings, rng)
    belief = _with_richer(layout, belief, settings.richer, prices, settings, rng)
    for answer in answers:
        belief = tell(layout, belief, answer, rng, settings, cell_price)
    return belief


def tell(
    layout: Layout, belief: SiteBelief, answer: SiteAnswer, rng: np.random.Generator,
    settings: SamplerSettings | None = None, cell_price: Floats | None = None,
) -> SiteBelief:
    """The belief after one more answer; arguments as of `believe`."""
    settings, prices = settings or SamplerSettings(), _prices(layout, cell_price)
    answers = (*belief.answers, answer)
    again = [
        _drawn(layout, belief.flights, one.pilot, answers, prices, settings, rng, one.draws, one.wishes) for one in belief.pilots
    ]
    again = [_with_earlier(layout, one, before, answer) for one, before in zip(again, belief.pilots, strict=True)]
    told = _weighed(layout, tuple(again), belief.flights, answers, prices, settings)
    told = replace(told, doubt=_doubt_after(layout, belief, answer))
    plain = next((one for one in told.pilots if one.wishes == ALIKE), None)
    if plain is None or plain.draws.answers > CONTRADICTED:
        return told
    known = {model.wishes.name for model in told.pilots}
    return _with_richer(layout, told, tuple(one for one in settings.contradicted if one.name not in known), prices, settings, rng)


def _doubt_after(layout: Layout, belief: SiteBelief, answer: SiteAnswer) -> float:
    """Bayes' rule: doubt fades as answers come out as the moves have them, and grows where they do not."""
    compiled = _compiled_answers((answer,))
    believed, doubted = (
        np.exp([log_answers(compiled, row) for row in best_sets(layout, maps)]).mean() for maps in (belief.maps, belief.doubting)
    )
    return float(rounded(belief.doubt * doubted / (belief.doubt * doubted + (1.0 - belief.doubt) * believed), 20))


def _with_earlier(layout: Layout, model: PilotBelief, before: PilotBelief, answer: SiteAnswer) -> PilotBelief:
    """Half of the maps from those drawn before the answer, as often as each makes it likely.

    A drawing after an answer is short, and by itself forgets now and then what was known; unless hardly any of the earlier maps
    goes with the answer, they keep it.
    """
    earlier, compiled = before.draws, _compiled_answers((answer,))
    ways = best_sets(layout, before.wishes.weights(layout, earlier.maps))
    fit = np.array([log_answers(compiled, row) for row in ways])
    weight = np.exp(fit - fit.max())
    if weight.sum() ** 2 < LEAST_SUPPORT * len(weight) * (weight**2).sum():
        return model
    number = len(model.draws.maps) // 2
    chosen = np.searchsorted(weight.cumsum() / weight.sum(), (np.arange(number) + 0.5) / number)
    kept = np.linspace(0, len(model.draws.maps) - 1, len(model.draws.maps) - number).round().astype(np.int64)
    maps = np.concatenate([earlier.maps[chosen], model.draws.maps[kept]])
    return model._replace(draws=model.draws._replace(maps=maps))


def _prices(layout: Layout, cell_price: Floats | None) -> Floats:
    """(cells,) log odds against each cell."""
    return np.full(layout.n_cells, CELL_PRICE) if cell_price is None else rounded(cell_price)


def _first(layout: Layout, flights: Moves, prices: Floats, settings: SamplerSettings, rng: np.random.Generator) -> SiteBelief:
    """From the moves alone: maps, then the models fitted to the likeliest of them, then maps again."""
    early = settings.early_steps(layout)
    models = tuple(_drawn(layout, flights, pilot, (), prices, settings, rng, None, steps=early) for pilot in PILOTS)
    for behind, steps in zip(BEHIND_BEFORE_FIT, (early, settings.last_steps(layout)), strict=True):
        models = _within(models, behind)
        fitted = [one.pilot.fitted(layout, flights, ALIKE, one.draws.best) for one in models]
        models = tuple(
            _drawn(layout, flights, pilot, (), prices, settings, rng, one.draws, steps=steps)
            for pilot, one in zip(fitted, models, strict=True)
        )
    return _weighed(layout, models, flights, (), prices, settings)


def _with_richer(
    layout: Layout, belief: SiteBelief, kinds: tuple[Wishes, ...], prices: Floats, settings: SamplerSettings,
    rng: np.random.Generator,
) -> SiteBelief:
    """The same with richer kinds of wishes, those that a first look finds likelier than the plain one.

    Under the model of the pilot that explains the moves best with plain wishes.
    """
    plain, flights, answers = next(one for one in belief.pilots if one.wishes == ALIKE), belief.flights, belief.answers
    models = list(belief.pilots)
    for wishes in kinds:
        one = _drawn(layout, flights, plain.pilot, answers, prices, settings, rng, plain.draws, wishes)
        if one.evidence < plain.evidence - UNPROMISING:
            continue
        for _ in BEHIND_BEFORE_FIT:
            pilot = one.pilot.fitted(layout, flights, wishes, one.draws.best)
            one = _drawn(layout, flights, pilot, answers, prices, settings, rng, one.draws, wishes)
        models.append(one)
    return belief if len(models) == len(belief.pilots) else _weighed(layout, tuple(models), flights, answers, prices, settings)


def _drawn(  # noqa: PLR0913, PLR0917 - what a drawing takes
    layout: Layout, flights: Moves, pilot: Pilot, answers: tuple[SiteAnswer, ...], prices: Floats,
    settings: SamplerSettings, rng: np.random.Generator, before: Draws | None, wishes: Wishes = ALIKE, steps: int | None = None,
) -> PilotBelief:
    """Maps under one model of the pilot, beginning where the last drawing ended."""
    problem = problem_of(layout, flights, pilot, answers, prices, wishes)
    starts = np.zeros((len(TEMPERATURES), wishes.n_places(layout)), dtype=np.uint8)
    if before is not None:
        n = before.last.shape[1]
        starts[:, :n] = before.last
        starts[1, :n], starts[-1] = before.best, 0
    draws = draw(problem, starts, steps or settings.steps(layout), settings.maps, rng, fresh=before is None)
    return PilotBelief(pilot, 0.0, draws, wishes)


def problem_of(
    layout: Layout, flights: Moves, pilot: Pilot, answers: tuple[SiteAnswer, ...], cell_price: Floats, wishes: Wishes = ALIKE,
) -> Problem:
    """What maps are judged by under one model of the pilot."""
    compiled = _compiled_answers(answers)
    asked = np.zeros(layout.n_states, dtype=np.uint8)
    asked[compiled.states] = 1
    relevant = asked.copy()
    relevant[flights.states] = 1
    moves = pilot.compiled(layout, flights, wishes.parts)
    return Problem(layout, moves, compiled, relevant, asked, cell_price, EDGE_PRICE, wishes.compiled(pilot.entry_price))


def _compiled_answers(answers: tuple[SiteAnswer, ...]) -> CompiledAnswers:
    first = np.cumsum([0, *(len(one.states) for one in answers)]).astype(np.int32)
    states = np.array([state for one in answers for state in one.states], dtype=np.int32)
    masks = [_masks(one) for one in answers]
    preferred, avoided = (np.array([mask[side] for mask in masks], dtype=np.uint8) for side in (0, 1))
    differences = np.arange(9)
    logs = rounded(np.log(RIGHT * OTHERWISE**differences + (1.0 - RIGHT) / WRONG_ANSWERS))
    return CompiledAnswers(first, states, preferred, avoided, logs)


def _masks(answer: SiteAnswer) -> tuple[int, int]:
    """Preferred and avoided as sums of 1 << action; where nothing is avoided all is right."""
    if not answer.avoided and not answer.preferred:
        return 15, 0
    return sum(1 << action for action in answer.preferred), sum(1 << action for action in answer.avoided)


def _weighed(
    layout: Layout, models: tuple[PilotBelief, ...], flights: Moves, answers: tuple[SiteAnswer, ...], prices: Floats,
    settings: SamplerSettings,
) -> SiteBelief:
    """The maps of all models that are not far behind, each in proportion to its evidence."""
    kept = sorted(_within(models, HOPELESSLY_BEHIND), key=lambda one: -one.evidence)
    odds = np.exp([(one.evidence - kept[0].evidence) / FLATTER for one in kept])
    weights = odds / odds.sum()
    kept = [one._replace(weight=float(weight)) for one, weight in zip(kept, weights, strict=True)]
    shares = [round(one.weight * settings.maps) for one in kept]
    maps = _together(layout, kept, [spread(one.draws.maps, share) for one, share in zip(kept, shares, strict=True)])
    halves = [spread(one.draws.doubting, max(1, share // 2)) for one, share in zip(kept, shares, strict=True)]
    counted = [one for one, share in zip(kept, shares, strict=True) if share]
    expected, keep_out = _marginals(layout, counted, flights, answers, prices)
    return SiteBelief(maps, expected, keep_out, _together(layout, kept, halves), tuple(kept), answers, flights)


def _marginals(
    layout: Layout, models: list[PilotBelief], flights: Moves, answers: tuple[SiteAnswer, ...], prices: Floats,
) -> tuple[Floats, Floats]:
    """What entering each cell is expected to cost, (cells,) or (layers, cells), and (cells,) whether it is to be kept out of."""
    shares = np.array([one.weight for one in models]) / sum(one.weight for one in models)
    weights, barring = [], []
    for one, share in zip(models, shares, strict=True):
        maps = spread(one.draws.maps, math.ceil(share * MARGINAL_MAPS))
        if one.wishes.own:
            each = one.wishes.weights(layout, one.draws.maps)
            weights.append(each.mean(axis=0))
            barring.append(barred(each).mean(axis=0))
        else:
            likely = level_probabilities(problem_of(layout, flights, one.pilot, answers, prices, one.wishes), maps)
            weights.append((likely @ one.wishes.level_weights)[None])
            barring.append(likely[:, KEEP_OUT])
    areas = max(len(each) for each in weights)
    every = [np.broadcast_to(each, (areas, layout.n_cells)) for each in weights]
    expected = rounded(np.tensordot(shares, every, 1), 30)
    return expected if areas > 1 else expected[0], rounded(shares @ np.array(barring), 30)


def _together(layout: Layout, models: list[PilotBelief], maps: list[Bytes]) -> Bytes | Floats:
    """Maps of several models in one array, in the simplest form that holds them."""
    if all(one.wishes == ALIKE for one in models):
        return np.concatenate(maps)
    weights = [one.wishes.weights(layout, part) for one, part in zip(models, maps, strict=True)]
    areas = max(part.shape[1] for part in weights)
    every = np.concatenate([np.broadcast_to(part, (len(part), areas, layout.n_cells)) for part in weights])
    return every[:, 0] if areas == 1 else every


def _within(models: tuple[PilotBelief, ...], behind: float) -> tuple[PilotBelief, ...]:
    """Those whose evidence is not further behind the best than this [nat]."""
    top = max(one.evidence for one in models)
    return tuple(one for one in models if one.evidence > top - behind)


def spread(maps: MapsT, number: int) -> MapsT:
    """A number of the maps, evenly from all; some more than once where there are fewer."""
    chosen: MapsT = maps[np.linspace(0, len(maps) - 1, number).round().astype(np.int64)]  # type: ignore[assignment]
    return chosen
