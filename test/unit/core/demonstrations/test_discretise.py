"""Samples -> demonstration, case by case."""

from dataclasses import replace

import numpy as np
import pytest

from advise_ros.core.demonstrations.demonstration import Demonstration, EndReason
from advise_ros.core.demonstrations.discretise import DiscretiseSettings, discretise
from advise_ros.core.demonstrations.samples import NO_COMMANDS, CommandSamples, PoseSamples, Recording, VehicleEvent
from advise_ros.core.grid.grid import Action, Grid
from advise_ros.core.units import NS
from support.flown import GRID, PERIOD_NS, START_NS, commands_of, flight, round_trip, track

SETTINGS = DiscretiseSettings()
ALL = (0, 2**62)
N, E, S, W = Action
JUMPED = 'into the flight: the origin of their frame was set anew, or they are of several vehicles'


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


def test_a_vehicle_that_is_pushed_elsewhere_than_commanded_all_the_way_is_told_and_the_command_is_the_action() -> None:
    recording = level((0.0, 0.0), (2.0, 0.0))
    recording.commands.velocities_enu_m_s[:] = (0.0, 1.0, 0.0)
    found = run(recording)
    assert found.actions == (N,) and found.audit.ambiguous_actions == 0
    assert found.audit.notes == ('1 moves went elsewhere than commanded; the command is the action',)


def test_taps_across_the_way_are_not_the_action() -> None:
    """Three cells flown north; just before each border a quarter of a second west, as a person corrects by a key."""
    recording = level((4.0, 0.0), (4.0, 4.0))
    north_m = recording.poses.positions_enu_m[:, 1]
    recording.commands.velocities_enu_m_s[(north_m > 0.95) & (north_m < 1.21)] = (-1.0, 0.0, 0.0)
    recording.commands.velocities_enu_m_s[(north_m > 2.95) & (north_m < 3.21)] = (-1.0, 0.0, 0.0)
    found = run(recording)
    assert found.actions == (N, N) and found.audit.notes == ()


def test_a_diagonal_stick_flies_what_it_flies() -> None:
    recording = level((0.0, 0.0), (2.0, 0.0))
    for velocity in ((0.7, 0.7, 0.0), (0.7, -0.69, 0.0), (0.3, 0.9, 0.0)):
        recording.commands.velocities_enu_m_s[:] = velocity
        assert run(recording).actions == (E,) and run(recording).audit.notes == ()


def test_a_move_without_a_command_is_a_drift_where_commands_are_recorded() -> None:
    recording = level((0.0, 0.0), (0.0, 2.0))
    for velocity in ((0.05, 0.0, 0.0), (np.nan, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)):
        recording.commands.velocities_enu_m_s[:] = velocity
        found = run(recording)
        assert found.states == ()
        assert found.audit.notes == ('1 moves without a command are left out: the vehicle drifted',)
    before = recording._replace(commands=NO_COMMANDS, commanded_ns=1)
    assert run(before).states == ()


@pytest.mark.parametrize(('ended_s', 'actions'), [(1.0, (N,)), (2.9, (N,)), (3.2, ())])
def test_a_vehicle_coasts_for_a_while_after_a_command(ended_s: float, actions: tuple[Action, ...]) -> None:
    recording = level((0.0, -0.9), *[(0.1, -0.9), (0.0, -0.9)] * 20, (0.0, 2.0))
    left_ns = int(recording.poses.stamps_ns[recording.poses.positions_enu_m[:, 1] > 1.2][0])
    tap_ns = left_ns - int((ended_s + SETTINGS.command_timeout_s) * NS)
    tap = CommandSamples(np.array([tap_ns]), np.array([[0.0, 1.0, 0.0]]))
    assert run(recording._replace(commands=tap)).actions == actions


def test_a_command_held_towards_the_edge_of_the_grid_is_a_step_in_place() -> None:
    """A fence holds the vehicle, the pilot does not let go of the key; then he goes on east."""
    still = np.tile([0.0, 0.0, GRID.altitude_m], (30, 1))
    moving = track([(0.0, 0.0, GRID.altitude_m), (2.0, 0.0, GRID.altitude_m)]).positions_enu_m
    positions = np.concatenate([still, moving])
    stamps = START_NS + PERIOD_NS * np.arange(len(positions), dtype=np.int64)
    commands = np.zeros_like(positions)
    commands[:25, 0], commands[30:, 0] = -1.0, 1.0
    found = run(Recording(PoseSamples(stamps, positions), CommandSamples(stamps, commands)))
    assert (found.states, found.actions) == ((0, 0), (W, E))
    assert found.stamps_ns == (START_NS, START_NS + 24 * PERIOD_NS)
    commands[12:25, 0] = 1.0  # Back and forth is no wish to leave.
    assert run(Recording(PoseSamples(stamps, positions), CommandSamples(stamps, commands))).actions == (E,)


@pytest.mark.parametrize(
    ('mode', 'autopilot', 'owner', 'actions'),
    [
        ('RTL', 'ardupilot', '', ()), ('LAND', 'px4', '', ()), ('AUTO.MISSION', '', '', ()), ('LOITER', 'px4', '', ()),
        ('LOITER', 'ardupilot', '', (E,)), ('POSCTL', 'px4', '', (E,)), ('STABILIZE', '', '', (E,)),
        ('GUIDED', 'ardupilot', 'ours', ()), ('GUIDED', 'ardupilot', 'others', (E,)), ('', '', '', ()),
    ],
)


def test_who_moves_the_vehicle_decides_whether_somebody_flew(mode: str, autopilot: str, owner: str, actions: object) -> None:
    """It moves without a command, in a recording that has commands."""
    event = VehicleEvent(START_NS - NS, True, True, mode, autopilot, owner)
    found = run(level((0.0, 0.0), (2.0, 0.0))._replace(commands=NO_COMMANDS, commanded_ns=1, events=(event,)))
    assert found.actions == actions
    assert found.audit.notes != () or actions


def test_the_final_waypoint_is_not_reached_by_an_autopilot_that_comes_home() -> None:
    recording = flight(GRID, round_trip(), landing=False)
    home_ns = int(recording.poses.stamps_ns[recording.poses.positions_enu_m[:, 1] > 3.0][-1])
    events = (*recording.events, VehicleEvent(home_ns, True, True, 'RTL', 'ardupilot'))
    found = run(recording._replace(events=events))
    assert found.end_reason is EndReason.END_OF_LOG and found.actions == (E, E, E, N, N, W, W, W)
    assert '2 moves are left out: the autopilot flew by itself (RTL)' in found.audit.notes


def test_a_command_given_on_arrival_does_not_change_the_move_before() -> None:
    recording = level((0.0, 0.0), (2.0, 0.0))
    entered = int(recording.poses.stamps_ns[recording.poses.positions_enu_m[:, 0] > 1.2][0])
    recording.commands.velocities_enu_m_s[recording.commands.stamps_ns >= entered] = (0.0, 1.0, 0.0)
    assert run(recording).actions == (E,)


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
        f'positions jump 3 times, by up to 10 m, first 1.0 s {JUMPED}',
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


@pytest.mark.parametrize(('times', 'how'), [(1, 'by 36 m'), (3, '3 times, by up to 36 m, first')])
def test_positions_that_jump_are_noted(times: int, how: str) -> None:
    flown = flight(GRID, round_trip())
    level = int(np.argmax(flown.poses.positions_enu_m[:, 2] > 4.0))
    positions = flown.poses.positions_enu_m.copy()
    for begin in range(level + 90, level + 90 + 20 * times, 20):
        positions[begin:] += (30.0, -20.0, 0.0) if positions[begin, 0] < 25.0 else (-30.0, 20.0, 0.0)
    moved = flown._replace(poses=flown.poses._replace(positions_enu_m=positions))
    window = int(flown.poses.stamps_ns[level]), int(flown.poses.stamps_ns[-1])
    found = run(moved, window_ns=window)
    assert [note for note in found.audit.notes if 'jump' in note] == [f'positions jump {how} 9.0 s {JUMPED}']
    assert not any('jump' in note for note in run(flown, window_ns=window).audit.notes)
