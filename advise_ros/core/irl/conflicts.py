"""Which answers cannot hold together: those that oppose each other, and minimal sets that only a reward's absence shows."""

from __future__ import annotations

from itertools import chain

from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.advice.state import Opposition, contradicting, opposed, preferences
from advise_ros.core.irl.program import Problem, advice_rows, slack_states
from advise_ros.core.irl.solvers.choose import solve

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
