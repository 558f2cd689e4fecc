"""ADVISE (algorithm 1) as one pure function: demonstrations and answers in, policy and next question out."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np
import numpy.typing as npt

from advise_ros.core.advice.advice import AdviceRecord, Query
from advise_ros.core.advice.confirmation import agreed
from advise_ros.core.advice.contradictions import advice_in
from advise_ros.core.advice.imitation import imitated
from advise_ros.core.demonstrations.action_counts import count
from advise_ros.core.demonstrations.demonstration import Demonstration, standing
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.reward import Inferred, infer
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.irl.solvers.local_preview import Solved, is_large
from advise_ros.core.learning.digest import digest, evidence, map_of
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.planning.process import mdp_of, occurring
from advise_ros.core.questions.expected_corrections import in_effect
from advise_ros.core.questions.grid_clusters import cluster_states, split
from advise_ros.core.questions.select import Numbering, Situation, drawn, mixed, next_query
from advise_ros.core.questions.uncertainty import uncertainty
from advise_ros.core.site import SITE

__all__ = ['LearnSettings', 'Learned', 'learn']


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
        doubt_left: what the best question that is still open is worth, see `queries.Asking`.
        enough_advice: it is worth less than the settings' `enough`.
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
) -> Learned:
    """Reward, policy and next question.

    Neither the order of the demonstrations nor that of the answers matters, and what was taken back of either
    leaves no trace (but in `n_demonstrations` and `log_length`).

    Args:
        grid: states and actions.
        settings: constants and readings.
        demonstrations: all that came, with those that take others back; at least one must stand.
        log: the advice log.
        version: number of the policy.
        next_query_id: number of the next query.
        budget: answers that the person is willing to give, -1 unlimited.
        earlier: for a preview: what was learnt before, near which a large program may be solved roughly.

    Raises:
        InputError: no demonstration stands, one is on another grid, or strict advice (slack_cost 0) that contradicts itself.
    """
    check_demonstrations(grid, demonstrations)
    held = standing(demonstrations)
    counts = count(grid, held)
    mdp = mdp_of(grid, settings.slip, settings.gamma)
    demonstrated = counts.distribution(settings.laplace)
    advice = advice_in(log)
    if settings.confirms:
        advice = agreed(advice, counts.taken)
    asks = replace(settings, acquisition=in_effect(settings.acquisition, counts.visits[occurring(grid)]))
    belief = None
    if settings.acquisition == SITE:
        from advise_ros.core.site.within_advise import belief_of, imitate  # noqa: PLC0415 - compiled loops: half a second

        belief = belief_of(grid, counts, log, settings.seed)
        favourite, advice = imitate(grid, belief, advice)
    else:
        favourite, advice = imitated(asks.acquisition, counts, advice)
    inferred = infer(mdp, favourite, advice, settings, earlier)
    unsure = uncertainty(demonstrated, inferred.probabilities, settings.w_p)
    clusters = cluster_states(grid, counts, settings)
    clusters = split(grid, clusters, mixed(log), settings.seed, drawn(log))
    situation = Situation(grid, asks, mdp, counts, demonstrated, inferred, unsure, clusters, belief)
    asking = next_query(situation, log, Numbering(version, next_query_id, budget))
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
        clusters=clusters,
        state_uncertainty=unsure.state,
        demonstrated=demonstrated,
        visits=counts.visits,
        query=asking.query,
        doubt_left=asking.doubt_left,
        enough_advice=asking.enough,
        contradictions=inferred.contradictions,
        unmet=tuple(inferred.unmet.tolist()),
        objective=inferred.objective,
        gap=inferred.solved.solution.gap,
        solver=inferred.solved.solution.solver,
        solved=inferred.solved if is_large(mdp) else None,
        keep_out=None if belief is None else belief.keep_out,
        digest=digest(
            map_of(grid), asdict(settings), evidence(held, advice), _decisions(inferred, clusters, asking.query)
        ),
    )


def check_demonstrations(grid: Grid, demonstrations: tuple[Demonstration, ...]) -> None:
    """Whether there is something to learn from.

    Raises:
        InputError: no demonstration stands, or one is on another grid.
    """
    for demonstration in demonstrations:
        check_grid(grid, demonstration)
    if not standing(demonstrations):
        raise InputError('there is no demonstration yet; fly or load at least one')


def check_grid(grid: Grid, demonstration: Demonstration) -> None:
    """Whether a demonstration lies on the grid.

    Raises:
        InputError: it does not.
    """
    if demonstration.grid != grid:
        raise InputError(
            f"demonstration '{demonstration.demonstration_id}' lies on another grid "
            f'({demonstration.grid.width} x {demonstration.grid.height} cells, '
            f'{demonstration.grid.n_layers} waypoints); use the same grid file for recorder and learner'
        )


def _decisions(inferred: Inferred, clusters: Ints, query: Query | None) -> list[object]:
    return [inferred.greedy.tolist(), clusters.tolist(), list(query.states) if query else None]
