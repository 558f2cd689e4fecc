"""IRL of algorithm 1: the reward that explains demonstrations and advice, and the policy that follows from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from advise_ros.core.advice.state import Imitated, contradicting
from advise_ros.core.errors import InputError
from advise_ros.core.irl.conflicts import conflicting
from advise_ros.core.irl.program import Evidence, InfeasibleError, Problem, Solution, pose, slack_states
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.irl.solvers.choose import AUTO, solve
from advise_ros.core.irl.solvers.local_preview import ROUGH, Solved, is_large, near
from advise_ros.core.numerics import Floats, Ints
from advise_ros.core.planning.process import Mdp, boltzmann, greedy, plan

# A way to an optimum of the program.
Solve = Callable[[Problem], Solution]


@dataclass(frozen=True, eq=False)
class Inferred:
    """The reward that the evidence speaks for, and its policy.

    Attributes:
        imitated: the evidence.
        problem, solution: equation (1) and its optimum.
        value: (n,) optimal value of the reward.
        q: (n, n_actions) indexed q[state, action].
        probabilities: (n, n_actions) Boltzmann policy of equation (3).
    """

    imitated: Imitated
    problem: Problem
    solution: Solution
    value: Floats
    q: Floats
    probabilities: Floats

    @property
    def reward(self) -> Floats:
        """(n,) learnt reward."""
        return self.solution.reward

    @cached_property
    def greedy(self) -> Ints:
        """(n,) best actions, ties to the lowest."""
        return greedy(self.q)

    @cached_property
    def unmet(self) -> Ints:
        """States whose advice the reward does not satisfy, ascending."""
        return slack_states(self.problem, self.solution)

    @cached_property
    def contradictions(self) -> tuple[int, ...]:
        """Ids of answers that cannot all hold, ascending."""
        records = self.imitated.advice
        return conflicting(self.problem, records) if len(self.unmet) else contradicting(records)


def infer(mdp: Mdp, imitated: Imitated, settings: LearnSettings, solve: Solve) -> Inferred:
    """Solve equation (1), then plan with its reward.

    Args:
        mdp: the process.
        imitated: the action a* of each state, and the advice that takes its place.
        settings: constants and readings.
        solve: finds an optimum.

    Raises:
        InputError: strict advice (slack_cost 0) that contradicts itself.
    """
    problem = pose(mdp, Evidence(imitated.favourite, imitated.preferences), settings.terms)
    try:
        solution = solve(problem)
    except InfeasibleError:
        raise InputError(_refusal(conflicting(problem, imitated.advice))) from None
    value, q = plan(mdp, solution.reward, solution.value)
    return Inferred(imitated, problem, solution, value, q, boltzmann(q, settings.temperature))


def solver_by_name(name: str, earlier: Solved | None = None) -> Solve:
    """A solver of `SOLVERS`, or by size.

    Args:
        name: a key, or 'auto'.
        earlier: of almost the same evidence: a proven preview near what changed is enough, where it is much quicker.
    """
    def optimum(problem: Problem) -> Solution:
        if earlier is None or name != AUTO or not is_large(problem.mdp):
            return solve(problem, name)
        preview = near(problem, earlier)
        return solve(problem, name, ROUGH) if preview is None else preview

    return optimum


def _refusal(ids: tuple[int, ...]) -> str:
    named = ' and '.join(map(str, ids)) or 'given'
    return f'answers {named} cannot hold together and slack_cost is 0 (strict); take one back or allow slack'
