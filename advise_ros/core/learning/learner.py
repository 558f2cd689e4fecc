"""ADVISE (algorithm 1) on the drone's grid as one pure function: demonstrations and answers in, policy and question out."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, astuple, dataclass

import numpy as np
import numpy.typing as npt

from advise_ros.core.advice.advice import AdviceRecord, Query
from advise_ros.core.advice.state import advice_state
from advise_ros.core.demonstrations.demonstration import Demonstration, count, standing
from advise_ros.core.errors import InputError
from advise_ros.core.grid.differences import what_differs
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.reward import solver_by_name
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.irl.solvers.local_preview import Solved, is_large
from advise_ros.core.learning.algorithm import improve
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.planning.process import process_of
from advise_ros.core.questions.clusters import cluster_states
from advise_ros.core.questions.query import Numbering, next_query
from advise_ros.core.site import SITE
from advise_ros.core.site.prior import NOTHING, SitePrior, kept_route


@dataclass(frozen=True)
class Learned:
    """What was learnt from the first `n_demonstrations` and the first `log_length` entries of the log.

    As an answer that is taken back, a demonstration that is taken back counts twice among the first ones, when it
    came and when it went, and leaves no trace in what is learnt.

    Attributes:
        version: of the policy, counts up from 1 in a session.
        greedy: (n,) uint8 action of each state.
        probabilities: (n, n_actions) Boltzmann policy of equation (3).
        reward, value: (n,) learnt reward and its optimal value.
        q: (n, n_actions).
        clusters: (n,) labels, -1 for states in which no flight acts (the end, and a waypoint already reached).
        state_uncertainty: (n,) U_s [nat].
        demonstrated: (n, n_actions) smoothed action distributions.
        visits: (n,) demonstrated actions in each state.
        query: the next question, None when nothing is open, the budget is spent or there is enough advice.
        doubt_left, enough_advice, least_worth, worth_unit: as `Asking`.
        contradictions: advice ids of answers that cannot all hold, ascending.
        unmet: states whose advice the reward does not satisfy (slack), ascending.
        objective: of equation (1).
        gap: relative distance of the objective to its proven bound.
        solver: who found it.
        digest: sha256 of grid, settings, demonstrations, advice, greedy actions, clusters and query states.
        solved: what previews of a large process start from; None where they are exact.
        keep_out: (cells,) probability that the person wants the cell kept out of; None unless acquisition is `site`.

    All arrays are read-only.
    """

    grid: Grid
    settings: LearnSettings
    version: int
    n_demonstrations: int
    log_length: int
    greedy: npt.NDArray[np.uint8]
    probabilities: Floats
    reward: Floats
    value: Floats
    q: Floats
    clusters: Ints
    state_uncertainty: Floats
    demonstrated: Floats
    visits: Ints
    query: Query | None
    doubt_left: float
    enough_advice: bool
    contradictions: tuple[int, ...]
    unmet: tuple[int, ...]
    objective: float
    gap: float
    solver: str
    digest: str
    solved: Solved | None
    keep_out: Floats | None = None
    least_worth: float = 0.0
    worth_unit: str = ''

    def __post_init__(self) -> None:
        for part in vars(self).values():
            if isinstance(part, np.ndarray):
                part.setflags(write=False)


def learn(  # noqa: PLR0913 - evidence and numbering of a session
    grid: Grid,
    settings: LearnSettings,
    demonstrations: tuple[Demonstration, ...],
    log: tuple[AdviceRecord, ...],
    *,
    version: int = 1,
    next_query_id: int = 1,
    budget: int = -1,
    earlier: Solved | None = None,
    prior: SitePrior = NOTHING,
) -> Learned:
    """Reward, policy and next question.

    The order of the demonstrations does not matter, and that of the answers only with acquisition `site`, which draws maps after
    each. What was taken back of either leaves no trace (but in `n_demonstrations` and `log_length`).

    Args:
        grid: states and actions.
        settings: constants and readings.
        demonstrations: all that came, with those that take others back; at least one must stand, unless there is a prior.
        log: the advice log.
        version: number of the policy.
        next_query_id: number of the next query.
        budget: answers that the person is willing to give, -1 unlimited.
        earlier: for a preview: what was learnt before, near which a large program may be solved roughly.
        prior: what was learnt of the site on other routes, for acquisition `site`; what it has of these demonstrations and
            answers counts once.

    Raises:
        InputError: no demonstration stands, one is on another grid, or strict advice (slack_cost 0) that contradicts itself.
    """
    check_demonstrations(grid, demonstrations, prior)
    check_prior(settings, prior)
    flown = standing(demonstrations)
    before = prior.without(kept_route(grid.waypoints, flown, advice_state(log))) if prior else prior
    counts, process = count(grid, flown), process_of(grid, settings.slip, settings.gamma)
    clusters = cluster_states(process, counts, settings)
    found = improve(process, settings, counts, clusters, log, solver_by_name(settings.solver, earlier), prior=before)
    inferred, solution = found.inferred, found.inferred.solution
    asking = next_query(grid, found, Numbering(version, next_query_id, budget))
    return Learned(
        grid=grid,
        settings=settings,
        version=version,
        n_demonstrations=len(demonstrations),
        log_length=len(log),
        greedy=inferred.greedy.astype(np.uint8),
        probabilities=inferred.probabilities,
        reward=inferred.reward,
        value=inferred.value,
        q=inferred.q,
        clusters=found.clusters,
        state_uncertainty=found.uncertainty.state,
        demonstrated=found.demonstrated,
        visits=counts.visits,
        query=asking.query,
        doubt_left=asking.doubt_left,
        enough_advice=asking.enough,
        least_worth=asking.least,
        worth_unit=asking.unit,
        contradictions=inferred.contradictions,
        unmet=tuple(inferred.unmet.tolist()),
        objective=solution.objective,
        gap=solution.gap,
        solver=solution.solver,
        solved=Solved(inferred.problem, solution) if is_large(process.mdp) else None,
        keep_out=None if found.belief is None else found.belief.keep_out,
        digest=digest(
            map_of(grid), asdict(settings), evidence(flown, found.imitated.advice),
            [inferred.greedy.tolist(), found.clusters.tolist(), list(asking.query.states) if asking.query else None],
            *([astuple(before)] if before else []),
        ),
    )


def kept_of(
    grid: Grid, demonstrations: tuple[Demonstration, ...], log: tuple[AdviceRecord, ...], prior: SitePrior = NOTHING,
) -> SitePrior:
    """All that is known of the site after a session, for other routes over it; arguments as of `learn`."""
    return prior.with_route(kept_route(grid.waypoints, standing(demonstrations), advice_state(log)))


def check_prior(settings: LearnSettings, prior: SitePrior) -> None:
    """Whether what is known of a site can be made use of.

    Raises:
        InputError: another acquisition learns nothing of sites.
    """
    if prior and settings.acquisition != SITE:
        raise InputError(
            f"a site's map is of use with acquisition '{SITE}' only, and it is '{settings.acquisition}'; "
            f"set acquisition to '{SITE}', or leave 'site_map_file' empty"
        )


def check_demonstrations(grid: Grid, demonstrations: tuple[Demonstration, ...], prior: SitePrior = NOTHING) -> None:
    """Whether there is something to learn from.

    Raises:
        InputError: no demonstration stands and nothing is known of the site, or one is on another grid.
    """
    for demonstration in demonstrations:
        check_grid(grid, demonstration)
    if not prior and not standing(demonstrations):
        raise InputError('there is no demonstration yet; fly or load at least one')


def check_grid(grid: Grid, demonstration: Demonstration) -> None:
    """Whether a demonstration lies on the grid.

    Raises:
        InputError: it does not.
    """
    if demonstration.grid != grid:
        raise InputError(
            f"demonstration '{demonstration.demonstration_id}' lies on another grid "
            f'({what_differs(demonstration.grid, grid)}); use the same grid file for recorder and learner'
        )


# -- the digest: one hash over what was decided from what; floats that a solver made stay out of it ------
def digest(*parts: object) -> str:
    """sha256 (hex) of the parts as JSON with sorted keys and no blanks, in UTF-8."""
    text = json.dumps(parts, sort_keys=True, separators=(',', ':'), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def evidence(demonstrations: Iterable[Demonstration], records: Iterable[AdviceRecord]) -> list[object]:
    """The demonstrations' moves and the advice, each in an order that does not depend on arrival."""
    flights = sorted([list(d.states), list(d.actions)] for d in demonstrations)
    advice = sorted([sorted(r.states), sorted(r.preferred), sorted(r.avoided)] for r in records)
    return [flights, advice]


def map_of(grid: Grid) -> list[object]:
    """What makes a grid."""
    return [
        grid.resolution_m, grid.width, grid.height, grid.origin_enu_m, grid.altitude_m, grid.waypoints, grid.blocked
    ]
