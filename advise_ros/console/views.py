"""Messages -> what the page draws: values of plain JSON, compact where there is one a state."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Any

import numpy as np
from nav_msgs.msg import OccupancyGrid

from advise_msgs import msg
from advise_ros.config import PolicyConfig
from advise_ros.core.advice.advice import AdviceRecord, AnswerOption, Query
from advise_ros.core.demonstrations.demonstration import Counts, Demonstration, count
from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.grid.tables import terminal
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.numerics import Floats
from advise_ros.core.planning.rollout import expected_success, rollout, step_budget
from advise_ros.core.questions.uncertainty import uncertainty
from advise_ros.core.units import NS
from advise_ros.ros.convert import stamp_to_ns

View = dict[str, Any]
# Digits of a share between 0 and 1, one character a state.
LEVELS = '0123456789abcdefghijklmnopqrstuvwxyz'
BUDGET_FACTOR = PolicyConfig.step_budget_factor
# Flown moments behind a question that are shown, the latest ones.
MOMENTS = 12
# Cells before and after a moment, so that one sees where it came from.
AROUND = 2


def map_view(grid: Grid) -> View:
    return {
        'width': grid.width, 'height': grid.height, 'layers': grid.n_layers,
        'resolution': grid.resolution_m, 'origin': list(grid.origin_enu_m), 'altitude': grid.altitude_m,
        'waypoints': list(grid.waypoints), 'blocked': list(grid.blocked),
    }


def flown_view(grid: Grid, demonstrations: Sequence[Demonstration]) -> View:
    """How often each direction was flown, for the states that were visited."""
    taken = count(grid, demonstrations).taken
    states = np.flatnonzero(taken.sum(axis=1))
    return {'demonstrations': len(demonstrations), 'states': states.tolist(), 'taken': taken[states].ravel().tolist()}


def policy_view(policy: msg.Policy, grid: Grid, taken: Counts, settings: LearnSettings, *, own: bool = True) -> View:
    """The greedy actions, the route from the start, and how unsure the learner is, between its extremes.

    Args:
        own: the settings are the learner's; else the usual ones, which the page tells.
    """
    greedy = np.asarray(policy.greedy, dtype=np.int64)
    start = grid.start_state()
    flight = rollout(grid, greedy.tolist(), start, step_budget(grid, start, BUDGET_FACTOR))
    return {
        'version': int(policy.version), 'log': int(policy.log_length), 'greedy': ''.join(map(str, policy.greedy)),
        'unsure': levels(unsure(policy, grid, taken, settings)), 'own': own,
        'route': list(flight.states), 'reaches': flight.reached, 'steps': flight.steps,
        'waypoints': flight.waypoints_reached, 'success': expected_success(grid, greedy, settings.slip, BUDGET_FACTOR),
    }


def unsure(policy: msg.Policy, grid: Grid, taken: Counts, settings: LearnSettings) -> Floats:
    """U_s of every state (definition 3) as the learner has it, (n,) [nat]; the least where a flight is over."""
    shares = np.asarray(policy.probabilities, dtype=np.float64).reshape(-1, N_ACTIONS)
    found = uncertainty(taken.distribution(settings.laplace), shares, settings.w_p).state
    found[terminal(grid)] = found.min()
    return found


def levels(values: Floats) -> str:
    """One character a value, from the smallest to the largest."""
    low, high = float(values.min()), float(values.max())
    share = (values - low) / (high - low) if high > low else np.zeros(len(values))
    return ''.join(LEVELS[int(level)] for level in np.rint(share * (len(LEVELS) - 1)))


def query_view(query: Query, moments: list[View], taken: Sequence[int] = (0, 0, 0, 0)) -> View:
    """The question; `taken` is how often each direction was flown at its states."""
    return {
        'id': query.query_id, 'version': query.policy_version, 'states': list(query.states),
        'question': query.question, 'taken': [int(number) for number in taken], 'flown': list(query.demonstrated),
        'policy': list(query.policy),
        # Shares of the greatest possible entropy: 1 is "all four directions alike".
        'disagree': query.disagreement / math.log(N_ACTIONS), 'scarce': query.scarcity / math.log(N_ACTIONS),
        'unsure': query.policy_uncertainty / math.log(N_ACTIONS),
        'before': list(query.answered_before), 'budget': query.budget_left, 'moments': moments,
        'disputed': list(query.disputed), 'worth': query.worth, 'options': [_option_view(option) for option in query.options],
    }


def _option_view(option: AnswerOption) -> View:
    return {
        'meaning': int(option.meaning), 'word': option.word, 'label': option.label,
        'preferred': list(option.preferred), 'avoided': list(option.avoided), 'route': list(option.route),
    }


def site_view(message: OccupancyGrid) -> View:
    """Probability of each cell that the person wants it kept out of [%]; -1 where it is blocked."""
    return {'keepOut': [int(share) for share in message.data]}


def moments_of(query: Query, grid: Grid, demonstrations: Iterable[Demonstration]) -> list[View]:
    """The flown moments behind a question: where the demonstrations went through its states."""
    asked, found = frozenset(query.states), []
    for demonstration in demonstrations:
        inside = [state in asked for state in demonstration.states]
        for is_inside, run in groupby(range(len(inside)), key=inside.__getitem__):
            if is_inside:
                indices = list(run)
                found.append(_moment(demonstration, grid, indices[0], indices[-1]))
    return found[-MOMENTS:]


def _moment(demonstration: Demonstration, grid: Grid, first: int, last: int) -> View:
    begin, end = max(0, first - AROUND), min(len(demonstration.states), last + 1 + AROUND)
    start_ns = demonstration.stamps_ns[begin]
    return {
        'id': demonstration.demonstration_id,
        'cells': [grid.cell_of(state) for state in demonstration.states[begin:end]],
        'layer': grid.next_waypoint(demonstration.states[first]),
        'seconds': [(stamp - start_ns) / NS for stamp in demonstration.stamps_ns[begin:end]],
        'inside': [first - begin, last - begin],
    }


def advice_view(record: AdviceRecord, stamp_ns: int) -> View:
    return {
        'id': record.advice_id, 'query': record.query_id, 'states': list(record.states),
        'preferred': list(record.preferred), 'avoided': list(record.avoided), 'verdict': int(record.verdict),
        'by': record.expert_id, 'comment': record.comment, 'at': stamp_ns / NS,
    }


def log_view(entries: Sequence[tuple[AdviceRecord, int]]) -> list[View]:
    """One view an answer, in order; what was taken back is marked.

    `entry` counts the log's entries from 1, `back` is the one that took the answer back, 0 while it holds.
    """
    back = {record.advice_id: entry for entry, (record, _) in enumerate(entries, start=1) if record.retracted}
    return [
        {
            **advice_view(record, stamp), 'entry': entry, 'retracted': record.advice_id in back,
            'back': back.get(record.advice_id, 0),
        }
        for entry, (record, stamp) in enumerate(entries, start=1) if not record.retracted
    ]


def learner_view(status: msg.LearnerStatus) -> View:
    names = {
        status.WAITING_FOR_DEMONSTRATIONS: 'waiting', status.LEARNING: 'learning', status.ASKING: 'asking',
        status.DONE: 'done', status.FAILED: 'failed',
    }
    return {
        'phase': names.get(status.phase, 'waiting'), 'version': int(status.policy_version),
        'demonstrations': int(status.demonstrations), 'answers': int(status.answers), 'query': int(status.query_id),
        'budget': int(status.budget_left), 'seconds': float(status.solve_s),
        'contradictions': [int(number) for number in status.contradictions],
        'message': status.message.splitlines()[0] if status.message else '',
        'enough': status.enough_advice, 'doubt': float(status.doubt_left), 'least': float(status.enough),
        'unit': status.worth_unit,
    }


def vehicle_view(vehicle: msg.VehicleStatus) -> View:
    return {
        'autopilot': vehicle.autopilot, 'mode': vehicle.mode, 'connected': vehicle.connected, 'ready': vehicle.ready,
        'armed': vehicle.armed, 'in_air': vehicle.in_air, 'commandable': vehicle.commandable,
        'waiting_for': vehicle.waiting_for, 'text': vehicle.text, 'owner': vehicle.owner, 'failsafe': vehicle.failsafe,
    }


def flight_view(flight: msg.FlightStatus) -> View:
    names = ('idle', 'to start', 'flying', 'succeeded', 'budget spent', 'blocked', 'canceled', 'stopped', 'lost')
    return {
        'phase': names[flight.phase] if flight.phase < len(names) else 'idle', 'id': int(flight.flight_id),
        'version': int(flight.policy_version), 'waypoint': int(flight.next_waypoint), 'steps': int(flight.steps),
        'budget': int(flight.step_budget), 'message': flight.message, 'refusals': int(flight.refusals), 'refusal': flight.refusal,
        'at': stamp_to_ns(flight.header.stamp) / NS,
    }
