"""Stage 4: policy + positions -> the policy's flights and the commands that it gave."""

from __future__ import annotations

import math
from collections import defaultdict

from advise_ros.config import PolicyConfig
from advise_ros.core.errors import InputError
from advise_ros.core.flight.leg_follower import Pose
from advise_ros.core.flight.policy_flight import FlightPhase, FlightPlan, PolicyFlight
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import ZERO
from advise_ros.replay.decisions import decision
from advise_ros.replay.flight_parts import RecordedFlight, flights_of
from advise_ros.replay.session import RecordedMessage, RecordedSession, at
from advise_ros.replay.stage import Comparison, Stage
from advise_ros.ros import convert
from advise_ros.ros.flying import velocity_command

# Ends that are commanded from outside and do not follow from the poses.
FROM_OUTSIDE = (FlightPhase.CANCELED, FlightPhase.STOPPED)


def flight_stages(session: RecordedSession, comparison: Comparison) -> list[Stage]:
    """Fly each flight again by the poses that its commands name."""
    commands, statuses = Stage('commands'), Stage('flight statuses')
    found, others = flights_of(session)
    poses = _poses(session)
    for flight in found:
        if flight.lacks:
            statuses.notes.append(flight.lacks)
            continue
        config = session.config(PolicyConfig, 'policy', flight.node_begun_ns, flight.statuses[0].message.publish_time_ns)
        if flight.cut_off:
            commands.notes.append(_cut_off(flight))
        try:
            flown = PolicyFlight(_plan(session, comparison, flight, config), config.seek_settings())
        except InputError as problem:
            statuses.count(f'{flight.statuses[0].where}: {problem}')
            continue
        _fly(comparison, flight, flown, poses, (commands, statuses))
    if others:
        commands.notes.append(f'{others} commands of pilots and holds, outside the flights of a policy, are not rebuilt')
    return [commands, statuses]


def _cut_off(flight: RecordedFlight) -> str:
    last = flight.commands[-1] if flight.commands else flight.statuses[-1]
    return (
        f'the flight that began at {at(flight.statuses[0].stamp_ns)} has no end in the bag: its policy node, or the '
        f'recording, ended before; it is rebuilt up to {at(last.stamp_ns)}'
    )


def _fly(
    comparison: Comparison, flight: RecordedFlight, flown: PolicyFlight, poses: dict[int, Pose], stages: tuple[Stage, Stage],
) -> None:
    commands, statuses = stages
    due = defaultdict(list)
    for one in flight.statuses[1:]:
        due[one.stamp_ns].append(one)
    for one in flight.commands:
        stamp_ns = one.stamp_ns
        pose = poses.get(stamp_ns)
        if pose is None:
            commands.count(_not_zero(one), in_bytes=comparison.same(velocity_command(ZERO, stamp_ns), one))
            continue
        rebuilt = velocity_command(flown.step(pose), stamp_ns)
        comparison.count(commands, rebuilt, one)
        for status in due.pop(stamp_ns, ()):
            _check_status(comparison, statuses, flown, status)
    for left in (status for waiting in due.values() for status in waiting):
        if left.value.phase not in FROM_OUTSIDE and left.stamp_ns > flight.statuses[0].stamp_ns:
            statuses.count(f'{left.where}: no command bears this stamp, expected one')


def _plan(session: RecordedSession, comparison: Comparison, flight: RecordedFlight, config: PolicyConfig) -> FlightPlan:
    """What the flight was flown by.

    Raises:
        InputError: the bag does not hold its policy, or that cannot be flown.
    """
    first = flight.statuses[0]
    version = int(first.value.policy_version)
    policy = _policy(session, first, version)
    if policy is None:
        raise InputError(f'policy_version is {version}, expected one of the policies that the bag holds until then')
    flown, greedy = convert.grid_from_msg(policy.value.grid), policy.value.greedy
    if comparison.what_if:
        learned = comparison.rebuilt.policies.get(policy.message.publish_time_ns)
        if learned is None:
            raise InputError('its policy could not be learnt again')
        greedy = learned.greedy
    grid = session.grid(flown)
    return FlightPlan(
        grid,
        tuple(int(action) for action in greedy),
        _start_cell(flown, grid, int(first.value.start_cell)),
        max(int(one.value.step_budget) for one in flight.statuses) if grid == flown else 0,
        config.step_budget_factor,
        config.stop_on_loop,
        config.centre_first,
        config.start_reach_m,
    )


def _start_cell(flown: Grid, grid: Grid, cell: int) -> int:
    """The cell at the same place of another grid."""
    if grid == flown or not 0 <= cell < flown.n_cells:
        return cell
    found = grid.cell_at(*flown.centre_enu_m(cell))
    if found is None:
        raise InputError('the place that it began at is off that grid')
    return found


def _policy(session: RecordedSession, first: RecordedMessage, version: int) -> RecordedMessage | None:
    """The last policy of that version published before the flight."""
    before = [
        one for one in session.on('advise/policy')
        if int(one.value.version) == version and one.message.publish_time_ns <= first.message.publish_time_ns
    ]
    return before[-1] if before else None


def _poses(session: RecordedSession) -> dict[int, Pose]:
    samples = session.recording.poses
    rows = zip(samples.stamps_ns.tolist(), samples.positions_enu_m.tolist(), strict=True)
    return {stamp_ns: Pose(stamp_ns, (x, y, z)) for stamp_ns, (x, y, z) in rows if math.isfinite(x + y + z)}


def _not_zero(one: RecordedMessage) -> str:
    """A command that no pose made is the watchdog's, and must be zero."""
    linear, angular = one.value.twist.linear, one.value.twist.angular
    for name, value in (('linear.x', linear.x), ('linear.y', linear.y), ('linear.z', linear.z), ('angular.z', angular.z)):
        if value != 0.0:
            return f'{one.where}: {name} is {value!r}, expected 0.0: no pose bears this stamp, so it is the watchdog'
    return ''


def _check_status(comparison: Comparison, statuses: Stage, flown: PolicyFlight, recorded: RecordedMessage) -> None:
    """Compare what follows from the poses; the end that a person or the vehicle made does not."""
    if recorded.value.phase in FROM_OUTSIDE:
        return
    expected = {
        'phase': int(flown.phase), 'state': flown.state, 'steps': flown.steps,
        'next_waypoint': flown.plan.grid.next_waypoint(flown.state),
    }
    found = decision(recorded.value, recorded.message.type_name)
    change = comparison.decide(expected, found, statuses.name)
    if comparison.what_if:
        statuses.count(f'{recorded.where}: {change}' if change else '')
        return
    wrong = (
        f'{recorded.where}: {name} is {found[name]}, expected {value}'
        for name, value in expected.items() if found[name] != value
    )
    statuses.count(next(wrong, ''))
