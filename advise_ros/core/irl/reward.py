"""IRL of algorithm 1: the reward that explains demonstrations and advice, its policy, and answers that cannot hold together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.advice.state import Imitated, Opposition, contradicting, opposed, preferences
from advise_ros.core.errors import InputError
from advise_ros.core.irl.program import Evidence, InfeasibleError, Problem, Solution, advice_rows, pose, slack_states
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


# So dear that slack means: no reward does without it.
SLACK_FORBIDDING = 1e6
# A minimal set takes a program for each answer: it is sought where states times answers are no more, and so often.
AFFORDABLE, SETS = 50_000, 5


def conflicting(
    problem: Problem, records: tuple[AdviceRecord, ...], against_each_other: Opposition = opposed,
) -> tuple[int, ...]:
    """Advice ids that cannot all hold, ascending.

    Two answers that oppose each other in a state are always named. Among the others no two do, yet no reward may
    satisfy them all, as when three answers lead round in a circle. Of those, minimal sets are named: whichever one
    of a set is taken back, the rest of it can hold. In large problems, where that costs too much, they are not.

    Args:
        problem: posed with all the records.
        records: the advice that holds.
        against_each_other: whether two answers about a state cannot both hold.
    """
    named = set(contradicting(records, against_each_other))
    apart = tuple(record for record in records if record.advice_id not in named)
    if problem.mdp.n_states * len(apart) > AFFORDABLE:
        return tuple(sorted(named))
    for _ in range(SETS):
        minimal = _minimal(problem, apart)
        if not minimal:
            break
        named |= {record.advice_id for record in minimal}
        apart = tuple(record for record in apart if record not in minimal)
    return tuple(sorted(named))


def _minimal(problem: Problem, records: tuple[AdviceRecord, ...]) -> tuple[AdviceRecord, ...]:
    """A part that cannot hold and of which every smaller part can; empty when all can.

    As if one after the other were left out, but halves first: what can be left out together can be one by one.
    """
    if _can_hold(problem, records):
        return ()
    kept: tuple[AdviceRecord, ...] = ()
    parts = [records]  # The next one to leave out comes last.
    while parts:
        part = parts.pop()
        if not _can_hold(problem, (*kept, *chain(*parts))):
            continue
        if len(part) == 1:
            kept += part
        else:
            parts += [part[len(part) // 2 :], part[: len(part) // 2]]
    return kept


def _can_hold(problem: Problem, records: tuple[AdviceRecord, ...]) -> bool:
    """Whether some reward satisfies the advice when nothing else is asked for; Pbar stays that of all answers."""
    if not records:
        return True
    advised, rows = advice_rows(problem.mdp, preferences(records))
    terms = problem.terms._replace(lambda_t=0.0, lambda_a=0.0, slack_cost=SLACK_FORBIDDING)
    alone = problem._replace(terms=terms, advised=advised, advice_pairs=rows)
    return not len(slack_states(alone, solve(alone)))
