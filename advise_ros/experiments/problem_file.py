"""Equation (1) on any problem: an .npz file or recorded flights in, an .npz file out; docs/paper.md lists the fields."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from advise_ros.core.advice.advice import AdviceRecord, Verdict
from advise_ros.core.advice.state import preferences, reversed_pair
from advise_ros.core.errors import InputError
from advise_ros.core.irl.program import (
    Evidence,
    InfeasibleError,
    Pairs,
    Problem,
    Solution,
    favourites,
    pose,
    slack_states,
)
from advise_ros.core.irl.reward import conflicting
from advise_ros.core.irl.settings import Terms
from advise_ros.core.irl.solvers.choose import AUTO, solve
from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.planning.process import Mdp, boltzmann, greedy, plan
from advise_ros.domains.fields import PROCESS, Fields, read_fields, read_process
from advise_ros.experiments.recorded import recorded

DEMONSTRATIONS = ('demo_state', 'demo_action')
ADVICE = ('advice_state', 'advice_preferred', 'advice_avoided')
# What each reading means for the program: name of the core's, cap, cost of slack.
READINGS: dict[str, tuple[str, float, float]] = {
    'R1': ('literal', 0.0, 0.0), 'R2': ('replace', 0.0, 1000.0), 'R3': ('replace', 0.2, 1000.0),
}
SYNONYMS = {'literal': 'R1', 'replace': 'R3'}
OPTIONS = ('reading', 'lambda_t', 'lambda_a', 'r_max', 'xi_cap', 'delta', 'slack_cost', 'temperature')
LARGEST = 1e9


class Given(NamedTuple):
    """A problem as read.

    Attributes:
        problem: as posed.
        temperature: of the Boltzmann policy.
        advice: what each row says, numbered as in the file.
    """

    problem: Problem
    temperature: float
    advice: tuple[AdviceRecord, ...] = ()


class Learned(NamedTuple):
    """What the result file holds; every array has a row for each of the n states.

    Attributes:
        reward: (n,) r.
        value, q: (n,), (n, n_actions) the optimal ones of that reward.
        policy: (n, n_actions) Boltzmann policy of equation (3).
        greedy: (n,) best action, ties to the lowest.
        program_value: (n,) v of the program, v = r + gamma Pbar v.
        objective: of the maximisation.
        xi: (n,) margins of the demonstrated states in D, 0 elsewhere.
        zeta, slack: (n,) margins and eta of the advised states, 0 elsewhere.
        status: 'optimal', or 'infeasible' (then numbers are NaN).
        gap: proven relative distance to the optimum.
        seconds: that solving took.
        contradictory: (k,) rows of the advice that cannot all hold, ascending; minimal sets where that is affordable.
    """

    reward: Floats
    value: Floats
    q: Floats
    policy: Floats
    greedy: Ints
    program_value: Floats
    objective: float
    xi: Floats
    zeta: Floats
    slack: Floats
    status: str
    gap: float
    seconds: float
    contradictory: Ints


def read_problem(path: str | Path, options: Mapping[str, Any]) -> Given:
    """The problem of a file; options given beside it come before those in it.

    Raises:
        InputError: the file cannot be read, or a field is missing or wrong; the message names it.
    """
    fields = read_fields(path)
    fields.arrays.update({name: np.array(value) for name, value in options.items() if value is not None})
    fields.check_names((*PROCESS, *DEMONSTRATIONS, *ADVICE, *OPTIONS))
    mdp = read_process(fields)
    states, actions = (
        fields.indices(name, end) for name, end in zip(DEMONSTRATIONS, (mdp.n_states, mdp.n_actions), strict=True)
    )
    fields.same_length(DEMONSTRATIONS)
    return _given(fields, mdp, favourites(mdp.n_states, mdp.n_actions, states, actions), _advice(fields, mdp))


def recorded_problem(dataset: str, options: Mapping[str, Any]) -> Given:
    """The problem that the flights of a dataset pose on its grid: moves are certain, nobody advises.

    Raises:
        InputError: the dataset cannot be read, or an option is wrong.
    """
    fields = Fields(dataset, {name: np.array(value) for name, value in options.items() if value is not None})
    mdp, counts = recorded(dataset)
    return _given(fields, mdp, counts.favourite(), ())


def _given(fields: Fields, mdp: Mdp, favourite: Ints, advice: tuple[AdviceRecord, ...]) -> Given:
    terms = _terms(fields)
    try:
        problem = _posed(mdp, Evidence(favourite, preferences(advice)), terms)
    except InputError as unbounded:
        reason = str(unbounded).replace('margin_cap', 'xi_cap')  # Its name in these files.
        raise fields.wrong('slack_cost', f'leaves no optimum: {reason}') from unbounded
    return Given(problem, fields.number('temperature', 1e-6, LARGEST, 1.0), advice)


def _terms(fields: Fields) -> Terms:
    named = fields.text('reading', (*READINGS, *SYNONYMS), 'R3')
    reading, cap, slack_cost = READINGS[SYNONYMS.get(named, named)]
    default = Terms()
    return Terms(
        reading,
        fields.number('lambda_t', 0.0, LARGEST, default.lambda_t),
        fields.number('lambda_a', 0.0, LARGEST, default.lambda_a),
        fields.number('r_max', 1e-9, LARGEST, default.r_max),
        fields.number('delta', 0.0, LARGEST, default.delta),
        fields.number('xi_cap', 0.0, LARGEST, cap),
        fields.number('slack_cost', 0.0, LARGEST, slack_cost),
    )


def _advice(fields: Fields, mdp: Mdp) -> tuple[AdviceRecord, ...]:
    """What each row says."""
    if not any(name in fields for name in ADVICE):
        return ()
    states = fields.indices('advice_state', mdp.n_states)
    preferred, avoided = (fields.flags(name, (len(states), mdp.n_actions)) for name in ADVICE[1:])
    _check_sets(fields, preferred, avoided)
    return tuple(
        AdviceRecord(row, row, (state,), _actions(preferred[row]), _actions(avoided[row]), Verdict.ANSWER)
        for row, state in enumerate(states.tolist())
    )


def _actions(flags: Bools) -> tuple[int, ...]:
    return tuple(np.flatnonzero(flags).tolist())


def _check_sets(fields: Fields, preferred: Bools, avoided: Bools) -> None:
    for name, flags in zip(ADVICE[1:], (preferred, avoided), strict=True):
        if (empty := np.flatnonzero(~flags.any(axis=1))).size:
            raise fields.wrong(name, f'names no action in row {empty[0]}; advice needs at least one of each')
    if (both := np.flatnonzero((preferred & avoided).any(axis=1))).size:
        raise fields.wrong('advice_avoided', f'names an action in row {both[0]} that is preferred there too')


def _posed(mdp: Mdp, evidence: Evidence, terms: Terms) -> Problem:
    """The program with every row of equation (1), also those of two actions with the same outcome.

    The learner leaves these out, because no reward can tell such actions apart; here they cost their slack.
    """
    problem = pose(mdp, evidence, terms)
    rows = [(state, better, worse) for state in sorted(evidence.advice) for better, worse in evidence.advice[state].pairs]
    pairs = Pairs(*np.array(rows, dtype=np.int64).reshape(-1, 3).T)
    return problem._replace(advice_pairs=pairs, advised=np.unique(pairs.states))


def learn(given: Given, solver: str = AUTO) -> Learned:
    """Reward, policy and margins."""
    problem, begin_s = given.problem, time.perf_counter()
    n, n_actions = problem.mdp.n_states, problem.mdp.n_actions
    try:
        solution = solve(problem, solver)
    except InfeasibleError:
        nothing, table = np.full(n, np.nan), np.full((n, n_actions), np.nan)
        seconds = time.perf_counter() - begin_s
        return Learned(
            nothing, nothing, table, table, np.full(n, -1), nothing, np.nan, nothing, nothing, nothing, 'infeasible',
            np.nan, seconds, _contradictory(given),
        )
    seconds = time.perf_counter() - begin_s
    value, q = plan(problem.mdp, solution.reward, solution.value)
    return Learned(
        solution.reward, value, q, boltzmann(q, given.temperature), greedy(q), solution.value, solution.objective,
        *_margins(problem, solution), solution.status, solution.gap, seconds,
        _contradictory(given) if len(slack_states(problem, solution)) else np.zeros(0, dtype=np.int64),
    )


def _contradictory(given: Given) -> Ints:
    """Rows that cannot all hold: those that compare actions with the same outcome alone, others together."""
    if not given.problem.terms.delta:
        return np.zeros(0, dtype=np.int64)  # A reward of 0 satisfies whatever is asked.
    alike = given.problem.mdp.alike
    alone = {said.advice_id for said in given.advice if alike[said.states[0]][np.ix_(said.preferred, said.avoided)].any()}
    others = {_words(said): said for said in given.advice if said.advice_id not in alone}  # Each once, however often said.
    named = {*conflicting(given.problem, tuple(others.values()), reversed_pair)}
    rows = [said.advice_id for said in given.advice if said.advice_id in alone or others[_words(said)].advice_id in named]
    return np.array(rows, dtype=np.int64)


def _words(said: AdviceRecord) -> tuple[tuple[int, ...], ...]:
    return said.states, said.preferred, said.avoided


def _margins(problem: Problem, solution: Solution) -> tuple[Floats, Floats, Floats]:
    """xi, zeta and eta with a row a state."""
    owners = ((problem.demonstrated, solution.xi), (problem.advised, solution.zeta), (problem.advised, solution.slack))
    found = np.zeros((3, problem.mdp.n_states))
    for row, (states, values) in zip(found, owners, strict=True):
        row[states] = values
    return found[0], found[1], found[2]


def write_result(path: str | Path, learned: Learned) -> None:
    """As .npz.

    Raises:
        InputError: the file cannot be written.
    """
    try:
        with Path(path).open('wb') as file:
            np.savez(file, **learned._asdict())
    except OSError as problem:
        raise InputError(f'{path} cannot be written ({problem.strerror}); name another file') from problem
