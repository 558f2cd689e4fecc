"""Time and memory of the learner's program, from 25 to 100 000 states, beside the paper's way of writing it.

    ./advise python benchmarks/learner.py [--states N ...] [--rivals NAME ...] [--no-walls] [--json FILE]

Each measurement has its own process. Cases are of benchmarks/learner_cases.py, with the default constants. Prints
Markdown. `seconds` is the time to solve the posed program; for 'default', what a learner does after one more answer:
pose and solve again (`cpu_seconds`: of processor time), with `preview_seconds` and `preview_gap` of what looks ahead
where a process is large. `used_mb` is the peak of memory above what the process held before it solved.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from learner_cases import GAMMA, SLIP, Case, make
from scipy.stats import linregress, t

SIZES = (25, 144, 256, 1024, 4096, 10_000, 40_000, 100_000)
WALLED = (1024, 10_000)
# The largest case that each is asked to solve.
RIVALS = {
    'dense cvxpy+GLPK': 1024, 'dense cvxpy+HiGHS': 1024, 'cvxpy+HiGHS': 1024, 'cvxpy+Clarabel': 10_000,
    'highs': 1024, 'piqp': 40_000, 'clarabel': 10_000, 'interior': 100_000,
    'interior-cholmod': 100_000,
}
DEFAULT = 'default'
# Cases below this are solved several times, the fastest counts.
SMALL, REPEATS = 2000, 3
# The fit of the growth leaves out what is so small that it measures the calls.
FIT_FROM = 1000
Row = dict[str, Any]


def solver_of(name: str) -> Callable[[Any], Any]:
    """The function that solves a problem, imported as it would be where nothing else is measured."""
    if 'cvxpy' in name:
        from advise_ros.core.irl.solvers.cvxpy_reference import Form, solve  # noqa: PLC0415 - imports count

        form = Form(name.startswith('dense'), name.split('+')[1].upper())
        return lambda problem: solve(problem, form)
    from advise_ros.core.irl.solvers import choose  # noqa: PLC0415

    return lambda problem: choose.solve(problem, choose.AUTO if name == DEFAULT else name)


def timed(action: Callable[[], Any], times: int = 1) -> tuple[float, Any]:
    """Seconds of the fastest of some runs, and what came of it."""
    took = []
    for _ in range(times):
        start = time.perf_counter()
        result = action()
        took.append(time.perf_counter() - start)
    return min(took), result


def peak_mb() -> float:
    """The most memory that this process has held."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def repeats(case: Case) -> int:
    """How often something is done to time it."""
    return REPEATS if case.grid.n_states < SMALL else 1


def measure(name: str, states: int, walls: bool) -> Row:
    """One row, in this process."""
    case = make(states, walls=walls)
    solve = solver_of(name)
    problem = case.posed()
    before = peak_mb()
    seconds, solution = timed(lambda: solve(problem), 1 if 'GLPK' in name else repeats(case))
    row: Row = {
        'solver': name, 'states': case.grid.n_states, 'walls': walls, 'seconds': seconds,
        'objective': solution.objective, 'gap': solution.gap, 'by': solution.solver,
        'peak_mb': peak_mb(), 'used_mb': peak_mb() - before,
    }
    return {**row, **after_an_answer(case, solve, solution, row['seconds'])} if name == DEFAULT else row


def after_an_answer(case: Case, solve: Callable[[Any], Any], earlier: Any, first: float) -> Row:
    """What happens when one more answer comes: the program again, planning, the policy, the clusters."""
    cpu, times = time.process_time(), repeats(case)
    seconds, solution = timed(lambda: solve(case.posed(after=True)), times)
    cpu = (time.process_time() - cpu) / times
    return {
        'first_seconds': first, 'seconds': seconds, 'cpu_seconds': cpu, 'gap': max(earlier.gap, solution.gap),
        **preview(case, earlier), **parts(case, solution), 'peak_mb': peak_mb(),
    }


def preview(case: Case, earlier: Any) -> Row:
    """Seconds and gap of looking ahead at the answer from the solution before it, the first time and again."""
    from advise_ros.core.irl.solvers.local_preview import Solved, is_large, near  # noqa: PLC0415

    if not is_large(case.mdp):
        return {}
    solved = Solved(case.posed(), earlier)
    first, _ = timed(lambda: near(case.posed(after=True), solved))
    seconds, found = timed(lambda: near(case.posed(after=True), solved))
    return {'first_preview_seconds': first, 'preview_seconds': seconds, 'preview_gap': found.gap if found else 1.0}


def parts(case: Case, solution: Any) -> Row:
    """Seconds of all else that a policy takes."""
    from advise_ros.core.demonstrations.demonstration import Counts  # noqa: PLC0415
    from advise_ros.core.irl.settings import LearnSettings  # noqa: PLC0415
    from advise_ros.core.planning.process import (  # noqa: PLC0415
        boltzmann,
        plan,
        process_of,
    )

    # Their imports are no part of the program's memory.
    from advise_ros.core.questions.clusters import cluster_states  # noqa: PLC0415

    planning, planned = timed(lambda: plan(case.mdp, solution.reward, solution.value), repeats(case))
    policy, _ = timed(lambda: boltzmann(planned.q, 0.1), repeats(case))
    small, settings = make(25), LearnSettings()
    cluster_states(process_of(small.grid, SLIP, GAMMA), Counts(small.taken), settings)  # The first call of all sets threads up.
    process = process_of(case.grid, SLIP, GAMMA)
    first, again = (timed(lambda: cluster_states(process, Counts(case.taken), settings))[0] for _ in range(2))
    return {'plan_seconds': planning, 'policy_seconds': policy, 'first_cluster_seconds': first, 'cluster_seconds': again}


def in_own_process(name: str, states: int, walls: bool) -> Row:
    """`measure`, in a process of its own."""
    command = [sys.executable, __file__, '--measure', json.dumps([name, states, walls])]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    if ended.returncode:
        raise SystemExit(f'{name} with {states} states ended badly:\n{ended.stderr}')
    return dict(json.loads(ended.stdout.splitlines()[-1]))


def growth(rows: Iterable[Row]) -> Row:
    """Exponent of seconds over states, with its 95 % interval; empty with fewer than three sizes."""
    points = [(row['states'], row['seconds']) for row in rows if row['states'] >= FIT_FROM and not row['walls']]
    if len(points) < 3:
        return {}
    x, y = np.log(np.array(points)).T
    fit = linregress(x, y)
    half = t.ppf(0.975, len(points) - 2) * fit.stderr
    return {'exponent': fit.slope, 'ci95': [fit.slope - half, fit.slope + half], 'sizes': len(points)}


def targets(rows: list[Row]) -> dict[str, Row]:
    """What was aimed at, what came of it; only where it was measured."""
    ours = {row['states']: row for row in rows if row['solver'] == DEFAULT and not row['walls']}
    dense = next((row for row in rows if row['solver'] == 'dense cvxpy+GLPK' and row['states'] == 1024), None)
    found: dict[str, Row] = {}

    def aim(name: str, value: float, limit: float, *, least: bool = False) -> None:
        found[name] = {'value': value, 'limit': limit, 'met': bool(value >= limit if least else value <= limit)}

    if dense and 1024 in ours:
        aim('times faster than dense GLPK, 1024 states', dense['seconds'] / ours[1024]['seconds'], 400, least=True)
        aim('share of its memory', ours[1024]['used_mb'] / dense['used_mb'], 0.1)
    for states, seconds in ((10_000, 0.3), (100_000, 5.0)):
        near = next((row for n, row in ours.items() if abs(n - states) < 0.01 * states), None)
        if near:
            aim(f're-plan after an answer, {states} states, s', near['seconds'], seconds)
            aim(f'its gap, {states} states', near['gap'], 1e-6)
            if states == 100_000:
                aim('peak memory, 100000 states, MB', near['peak_mb'], 600)
                aim('preview of an answer, 100000 states, s', near['preview_seconds'], 0.3)
                aim('its gap', near['preview_gap'], 1e-3)
    for part, program in (('plan', ''), ('policy', ''), ('cluster', ''), ('first_cluster', 'first_')):
        if ours:
            share = max(row[f'{part}_seconds'] / row[f'{program}seconds'] for row in ours.values())
            aim(f'largest share of the program: {part}', share, 0.25)
    return found


def table(rows: list[Row]) -> str:
    """Seconds and MB: a line a solver, a column a size."""
    columns = sorted({(row['states'], row['walls']) for row in rows})
    heads = [f'{states}{" walls" if walls else ""}' for states, walls in columns]
    lines = [f'| s / MB | {" | ".join(heads)} |', '| --- ' * (len(columns) + 1) + '|']
    for solver in dict.fromkeys(row['solver'] for row in rows):
        at = {(row['states'], row['walls']): row for row in rows if row['solver'] == solver}
        cells = [f'{at[c]["seconds"]:.3g} / {at[c]["used_mb"]:.0f}' if c in at else '-' for c in columns]
        lines.append(f'| {solver} | {" | ".join(cells)} |')
    return '\n'.join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--states', type=int, nargs='+', default=list(SIZES))
    parser.add_argument('--rivals', nargs='*', choices=list(RIVALS), default=list(RIVALS), metavar='NAME', help=', '.join(RIVALS))
    parser.add_argument('--no-walls', action='store_true', help='leave grids with walls out')
    parser.add_argument('--json', type=Path, help='where the figures go')
    parser.add_argument('--measure', help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        print(json.dumps(measure(*json.loads(options.measure))))
        return
    plans = [(name, n, False) for n in options.states for name in (DEFAULT, *options.rivals) if n <= RIVALS.get(name, n)]
    plans += [(DEFAULT, n, True) for n in options.states if n in WALLED and not options.no_walls]
    rows = []
    for plan in plans:
        rows.append(in_own_process(*plan))
        print(f'{plan[0]}: {plan[1]} states, {rows[-1]["seconds"]:.3g} s', file=sys.stderr, flush=True)
    report(rows, options.json)


def report(rows: list[Row], file: Path | None) -> None:
    """The table and what became of the targets."""
    ours = [row for row in rows if row['solver'] == DEFAULT]
    aims, fit = targets(rows), growth(ours)
    print(table(rows))
    if fit:
        print(f'\nseconds grow with states to the power {fit["exponent"]:.2f} ({fit["ci95"][0]:.2f}-{fit["ci95"][1]:.2f})')
    for name, aim in aims.items():
        print(f'- {"met" if aim["met"] else "missed"}: {name}: {aim["value"]:.3g} (limit {aim["limit"]:g})')
    if file:
        figures = {
            'cores': os.cpu_count(), 'rows': rows, 'growth': fit, 'targets': aims,
            'targets_met': {name: aim['met'] for name, aim in aims.items()},
        }
        file.write_text(json.dumps(figures, indent=2) + '\n')


if __name__ == '__main__':
    main()
