"""Samples -> demonstration, case by case."""

from dataclasses import replace

import numpy as np
import pytest

from advise_ros.core.demonstration import Demonstration, EndReason
from advise_ros.core.discretise import DiscretiseSettings, direction, discretise
from advise_ros.core.grid import Action, Grid
from advise_ros.core.samples import NO_COMMANDS, CommandSamples, PoseSamples, Recording
from support.flown import GRID, NS, PERIOD_NS, START_NS, commands_of, flight, round_trip, track

SETTINGS = DiscretiseSettings()
ALL = (0, 2**62)
N, E, S, W = Action


def run(
    recording: Recording, grid: Grid = GRID, settings: DiscretiseSettings = SETTINGS, window_ns: tuple[int, int] = ALL,
) -> Demonstration:
    return discretise(grid, recording, window_ns, settings, 'flight-001', EndReason.END_OF_LOG)


def level(*points: tuple[float, float], grid: Grid = GRID) -> Recording:
    poses = track([(x, y, grid.altitude_m) for x, y in points])
    return Recording(poses, commands_of(poses), source='made up')


def with_sample(recording: Recording, index: int, stamp_ns: int, position: tuple[float, float, float]) -> Recording:
    stamps, positions = recording.poses
    poses = PoseSamples(np.insert(stamps, index, stamp_ns), np.insert(positions, index, position, axis=0))
    return recording._replace(poses=poses)


def test_a_route_ends_at_the_final_waypoint() -> None:
    found = run(flight(GRID, round_trip()))
    assert found.actions == (E, E, E, N, N, W, W, W, S, S)
    assert [GRID.cell_of(s) for s in found.states] == round_trip()[:-1]
    assert [GRID.next_waypoint(s) for s in found.states] == [0, 0, 0, 1, 1, 2, 2, 2, 2, 2]
    assert found.end_reason is EndReason.FINAL_WAYPOINT
    assert all(found.states[i + 1] == GRID.successor(found.states[i], found.actions[i]) for i in range(9))


def test_samples_after_the_final_waypoint_are_not_looked_at() -> None:
    flown = flight(GRID, round_trip(), landing=False)
    longer = flight(GRID, [*round_trip(), 1, 2], landing=False)
    assert run(longer) == run(flown)


def test_the_command_in_force_is_the_action_and_not_the_motion() -> None:
    recording = level((0.0, 0.0), (2.0, 0.0))
    recording.commands.velocities_enu_m_s[:] = (0.1, 1.0, 0.0)
    found = run(recording)
    assert found.actions == (N,) and found.audit.ambiguous_actions == 0
    assert found.audit.notes == ('1 moves went elsewhere than commanded; the command is the action',)


def test_a_command_given_on_arrival_does_not_change_the_move_before() -> None:
    recording = level((0.0, 0.0), (2.0, 0.0))
    entered = int(recording.poses.stamps_ns[recording.poses.positions_enu_m[:, 0] > 1.2][0])
    recording.commands.velocities_enu_m_s[recording.commands.stamps_ns >= entered] = (0.0, 1.0, 0.0)
    assert run(recording).actions == (E,)


@pytest.mark.parametrize(
    'velocity', [(0.7, 0.7, 0.0), (0.7, -0.69, 0.0), (0.05, 0.0, 0.0), (np.nan, 1.0, 0.0), (0.0, 0.0, 1.0)],
)
def test_without_a_clear_command_the_motion_decides(velocity: tuple[float, float, float]) -> None:
    recording = level((0.0, 0.0), (0.0, 2.0))
    recording.commands.velocities_enu_m_s[:] = velocity
    found = run(recording)
    assert found.actions == (N,) and found.audit.ambiguous_actions == 1


def test_an_old_command_says_nothing() -> None:
    recording = level((0.0, 0.0), (0.0, 2.0))
    first = CommandSamples(recording.commands.stamps_ns[:1], np.array([[1.0, 0.0, 0.0]]))
    assert run(recording._replace(commands=first)).actions == (N,)
    assert run(recording._replace(commands=first), settings=replace(SETTINGS, command_timeout_s=10.0)).actions == (E,)


def test_no_commands_at_all_is_noted() -> None:
    found = run(level((0.0, 0.0), (0.0, 2.0))._replace(commands=NO_COMMANDS))
    assert found.audit.notes == ('no commands were recorded: the motion decided every move',)


def test_hovering_on_a_border_makes_no_moves() -> None:
    found = run(level((0.0, 0.0), *[(0.9, 0.0), (1.15, 0.0)] * 10, (0.0, 0.0)))
    assert found.states == () and found.audit.samples > 50


def test_bad_samples_are_dropped_and_counted() -> None:
    clean = level((0.0, 0.0), (4.0, 0.0))
    at = int(clean.poses.stamps_ns[10])
    dirty = with_sample(clean, 20, 0, (9.0, 9.0, 5.0))  # No stamp.
    dirty = with_sample(dirty, 15, at, (5.0, 3.0, 5.0))  # Repeated stamp.
    dirty = with_sample(dirty, 15, at - 7, (5.0, 3.0, 5.0))  # Late.
    dirty = with_sample(dirty, 10, at - 1, (-4.0, 0.0, 5.0))  # Outside.
    dirty = with_sample(dirty, 10, at - 2, (np.nan, 0.0, 5.0))
    dirty = with_sample(dirty, 10, at - 3, (5.0, 3.0, 7.0))  # Too high.
    found, expected = run(dirty), run(clean)
    assert (found.states, found.actions, found.stamps_ns) == (expected.states, expected.actions, expected.stamps_ns)
    audit = found.audit
    assert (audit.unstamped, audit.late, audit.out_of_grid) == (1, 2, 1)
    assert audit.samples == expected.audit.samples + 6
    assert audit.notes == (
        '1 positions are not numbers and were dropped',
        '1 samples more than 1 m off the altitude of 5 m were not used',
    )


def test_a_diagonal_is_resolved_and_counted() -> None:
    poses = PoseSamples(np.array([1, 2]) * NS, np.array([[0.0, 0.0, 5.0], [2.0, 2.5, 5.0]]))
    found = run(Recording(poses))
    assert found.actions == (N, E) and found.audit.cell_skips == 1 and found.audit.ambiguous_actions == 0


def test_a_jump_leaves_the_unknown_move_out() -> None:
    wide = Grid(2.0, 12, 3, (-1.0, -1.0), 5.0, waypoints=(35,))
    poses = PoseSamples(np.arange(1, 5) * NS, np.array([[0.0, 0, 5], [2.0, 0, 5], [20.0, 0, 5], [20.0, 2.0, 5]]))
    found = run(Recording(poses), wide)
    assert [wide.cell_of(s) for s in found.states] == [0, 10] and found.actions == (E, N)
    assert found.audit.cell_skips == 8
    assert 'the moves from cell [1, 0] to [10, 0] are not known, 2.0 s into the flight' in found.audit.notes


def test_the_longest_gap_is_noted() -> None:
    recording = level((0.0, 0.0), (4.0, 0.0))
    kept = np.r_[0:5, 30:41]
    found = run(recording._replace(poses=PoseSamples(recording.poses.stamps_ns[kept], recording.poses.positions_enu_m[kept])))
    assert found.audit.max_gap_s == pytest.approx(26 * PERIOD_NS / NS)
    assert '2.60 s passed between two used samples' in found.audit.notes


def test_a_blocked_cell_ends_it() -> None:
    grid = replace(GRID, blocked=(1,))
    found = run(level((0.0, 0.0), (4.0, 0.0)), grid)
    assert found.end_reason is EndReason.BLOCKED and found.states == (0,) and found.actions == (E,)


def test_a_final_waypoint_that_the_samples_do_not_show_is_not_claimed() -> None:
    recording = level((0.0, 0.0), (2.0, 0.0))
    found = discretise(GRID, recording, ALL, SETTINGS, 'x', EndReason.FINAL_WAYPOINT)
    assert found.end_reason is EndReason.STOPPED


def test_windows_cut_both_ends_included() -> None:
    recording = flight(GRID, round_trip())
    stamps = recording.poses.stamps_ns
    found = run(recording, window_ns=(int(stamps[60]), int(stamps[90])))
    assert found.window_ns == (stamps[60], stamps[90]) and found.audit.samples == 31


def test_a_window_without_positions_says_so() -> None:
    found = run(level((0.0, 0.0), (2.0, 0.0)), window_ns=(1, START_NS - 1))
    assert found.states == () and found.audit.notes == ('no positions in the window',)


@pytest.mark.parametrize(
    ('velocity', 'expected'),
    [
        ((1.0, 0.2), E), ((-1.0, 0.2), W), ((0.2, 1.0), N), ((0.2, -1.0), S),
        ((1.0, 0.95), None), ((0.0, 0.0), None), ((1.0, 0.89), E),
    ],
)
def test_directions(velocity: tuple[float, float], expected: Action | None) -> None:
    assert direction(*velocity, 0.1) == expected
