"""IRL of algorithm 1: the reward that explains demonstrations and advice, and the policy that follows from it."""

from __future__ import annotations

from typing import NamedTuple

from advise_ros.core.advice import contradictions
from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.errors import InputError
from advise_ros.core.irl.conflicts import conflicting, slack_states
from advise_ros.core.irl.program import Evidence, InfeasibleError, Problem, Solution, pose
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.irl.solvers.choose import AUTO, solve
from advise_ros.core.irl.solvers.local_preview import ROUGH, Solved, is_large, near
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.planning.process import Mdp, boltzmann, greedy, plan


class Inferred(NamedTuple):
    """What the evidence says.

    Attributes:
        reward, value: (n,) learnt reward and its optimal value.
        q: (n, n_actions).
        greedy: (n,) best actions, ties to the lowest.
        probabilities: (n, n_actions) Boltzmann policy.
        objective: of equation (1).
        unmet: states whose advice the reward does not satisfy, ascending.
        contradictions: ids of answers that cannot all hold, ascending.
        solved: the program and its solution.
    """

    reward: Floats
    value: Floats
    q: Floats
    greedy: Ints
    probabilities: Floats
    objective: float
    unmet: Ints
    contradictions: tuple[int, ...]
    solved: Solved


def infer(
    mdp: Mdp, favourite: Ints, records: tuple[AdviceRecord, ...], settings: LearnSettings, earlier: Solved | None = None,
) -> Inferred:
    """Solve equation (1), then plan with its reward.

    Args:
        mdp: the process.
        favourite: (n,) a*, -1 without a demonstration.
        records: the advice that holds.
        settings: constants and readings.
        earlier: of almost the same evidence: a proven preview near what changed is enough, where it is much quicker.

    Raises:
        InputError: strict advice (slack_cost 0) that contradicts itself.
    """
    problem = pose(mdp, Evidence(favourite, contradictions.preferences(records)), settings.terms)
    try:
        solution = _solution(problem, settings.solver, earlier)
    except InfeasibleError:
        raise InputError(_refusal(conflicting(problem, records))) from None
    unmet = slack_states(problem, solution)
    value, q = plan(mdp, solution.reward, solution.value)
    return Inferred(
        solution.reward, value, q, greedy(q), boltzmann(q, settings.temperature), solution.objective, unmet,
        conflicting(problem, records) if len(unmet) else contradictions.among(records), Solved(problem, solution),
    )


def _solution(problem: Problem, solver: str, earlier: Solved | None) -> Solution:
    """The optimum; where one takes long and a preview is asked for, what lies near it."""
    if earlier is None or solver != AUTO or not is_large(problem.mdp):
        return solve(problem, solver)
    preview = near(problem, earlier)
    return solve(problem, solver, ROUGH) if preview is None else preview


def _refusal(ids: tuple[int, ...]) -> str:
    named = ' and '.join(map(str, ids)) or 'given'
    return f'answers {named} cannot hold together and slack_cost is 0 (strict); take one back or allow slack'
