"""The reply of advise/preview: the policy as it is beside the policy as it would be."""

from __future__ import annotations

import time

import numpy as np

from advise_msgs.srv import PreviewAnswer
from advise_ros.config import PolicyConfig
from advise_ros.core.advice.advice import Code, Outcome
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.program import EXACT
from advise_ros.core.learning.learner import Learned
from advise_ros.core.learning.session import Work
from advise_ros.core.numerics import Floats
from advise_ros.core.planning.rollout import Rollout, expected_success, rollout, step_budget
from advise_ros.ros import calls, maps

# As the policy node flies by default.
BUDGET_FACTOR = PolicyConfig.step_budget_factor
# A cell is likely to be kept out of from this probability on.
LIKELY = 0.5


def fill_refused(response: PreviewAnswer.Response, outcome: Outcome) -> PreviewAnswer.Response:
    response.valid, response.code, response.message = False, int(outcome.code), outcome.message
    response.contradicts = list(outcome.contradicts)
    return response


def try_answer(response: PreviewAnswer.Response, before: Learned, work: Work) -> None:
    """Learn with an answer, and fill in what it changes. It takes as long as learning does.

    Args:
        response: to be filled.
        before: the policy as it is.
        work: what is to be learnt.

    Raises:
        InputError: as `learn`.
    """
    begin_s = time.monotonic()
    after = work.run()
    fill_preview(response, before, after, time.monotonic() - begin_s)


def fill_preview(response: PreviewAnswer.Response, before: Learned, after: Learned, solve_s: float) -> None:
    """Routes are greedy, from the start state, within the default step budget."""
    changed = np.flatnonzero(before.greedy != after.greedy)
    response.valid, response.code = True, int(Code.OK)
    response.changed_states = changed.tolist()
    response.changed_actions = after.greedy[changed].tolist()
    route_before, route_after = _route(before), _route(after)
    response.route_before, response.route_after = list(route_before.states), list(route_after.states)
    response.reaches_goal_before, response.reaches_goal_after = route_before.reached, route_after.reached
    response.expected_success_before, response.expected_success_after = _success(before), _success(after)
    response.solve_s = solve_s
    parts = [_changed(len(changed)), _reaching(route_before, route_after)]
    if after.keep_out is not None:
        _fill_site(response, after.grid, after.keep_out, route_before, route_after)
        parts.append(_entering(response))
    response.message = '; '.join([*parts, *_against(after.contradictions), *_roughly(after.gap)]) + '.'


def _fill_site(response: PreviewAnswer.Response, grid: Grid, keep_out: Floats, before: Rollout, after: Rollout) -> None:
    """What each route enters, by what would be believed after the answer."""
    response.keep_out_after = maps.percent(keep_out).tolist()
    for name, flown in (('before', before), ('after', after)):
        cells = [grid.cell_of(state) for state in flown.states[1:]]
        setattr(response, f'entered_{name}', [cell for cell in cells if keep_out[cell] >= LIKELY])
        setattr(response, f'expected_entries_{name}', float(np.float32(keep_out[cells].sum())))


def _entering(response: PreviewAnswer.Response) -> str:
    before, after = len(response.entered_before), len(response.entered_after)
    return f'it would enter {after} cell{"s" if after != 1 else ""} that you likely want kept out of, today\'s route {before}'


def _route(learned: Learned) -> Rollout:
    start = learned.grid.start_state()
    return rollout(learned.grid, learned.greedy.tolist(), start, step_budget(learned.grid, start, BUDGET_FACTOR))


def _success(learned: Learned) -> float:
    return expected_success(learned.grid, learned.greedy, learned.settings.slip, BUDGET_FACTOR)


def _changed(number: int) -> str:
    return f'{number} state{"s" if number != 1 else ""} would get another action'


def _reaching(before: Rollout, after: Rollout) -> str:
    if after.reached:
        return f'the route would {"still" if before.reached else "now"} reach the final waypoint, in {after.steps} steps'
    progress = f'after {after.waypoints_reached} waypoint{"s" if after.waypoints_reached != 1 else ""}'
    return f'the route would {"no longer" if before.reached else "still not"} reach the final waypoint, it ends {progress}'


def _roughly(gap: float) -> tuple[str, ...]:
    """What an approximate preview misses the optimum by at most; it is exact when the answer is given."""
    return (f'a quick look, proven to be within {gap:.2g} of the optimum',) if gap > EXACT else ()


def _against(contradictions: tuple[int, ...]) -> tuple[str, ...]:
    return (f'then {calls.cannot_hold(contradictions)}',) if contradictions else ()
