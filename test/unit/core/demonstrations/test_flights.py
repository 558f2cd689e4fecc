"""Where flights begin and end."""

import numpy as np

from advise_ros.core.demonstrations.demonstration import EndReason
from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.flight_windows import Flight
from advise_ros.core.demonstrations.recorded_flights import Cutter, demonstrations_of, waypoints_reached
from advise_ros.core.demonstrations.recorded_flights import split as flown
from advise_ros.core.demonstrations.samples import NO_COMMANDS, PolicyEvent, PoseSamples, Recording, VehicleEvent
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import NS
from support.flown import GRID, START_NS, flight, joined, round_trip

SECOND_NS = 5000 * NS
BOTH = joined(flight(GRID, round_trip()), flight(GRID, round_trip()[:4], SECOND_NS))
SETTINGS = DiscretiseSettings()


def split(grid: Grid, recording: Recording, tolerance_m: float) -> tuple[Flight, ...]:
    return tuple(one.flight for one in flown(grid, recording, tolerance_m))


def by_policy(begin_s: float, end_s: float) -> tuple[PolicyEvent, ...]:
    return (PolicyEvent(START_NS + int(begin_s * NS), True), PolicyEvent(START_NS + int(end_s * NS), False))


def test_flights_begin_at_altitude_and_end_by_landing() -> None:
    first, second = split(GRID, BOTH, 1.0)
    assert first.window_ns == (START_NS + 4 * NS, START_NS + 30 * NS)
    assert (first.end_reason, second.end_reason) == (EndReason.LANDED, EndReason.LANDED)
    assert second.window_ns[0] == SECOND_NS + 4 * NS


def test_altitude_alone_gives_the_same_demonstrations() -> None:
    by_state = demonstrations_of(GRID, BOTH, SETTINGS)
    by_altitude = demonstrations_of(GRID, BOTH._replace(events=()), SETTINGS)
    assert by_state.demonstrations[0] == by_altitude.demonstrations[0]
    assert [d.states for d in by_state.demonstrations] == [d.states for d in by_altitude.demonstrations]
    assert [d.demonstration_id for d in by_state.demonstrations] == ['flight-001', 'flight-002']


def test_disarming_and_the_end_of_the_log_end_a_flight() -> None:
    flown = flight(GRID, round_trip()[:4], landing=False)
    off = VehicleEvent(START_NS + 9 * NS, False, True)
    assert split(GRID, flown._replace(events=(*flown.events, off)), 1.0)[0].end_reason is EndReason.DISARMED
    (unended,) = split(GRID, flown, 1.0)
    assert unended.end_reason is EndReason.END_OF_LOG and unended.window_ns[1] == flown.poses.stamps_ns[-1]
    (unended,) = split(GRID, flown._replace(events=()), 1.0)
    assert unended.end_reason is EndReason.END_OF_LOG


def test_a_flight_that_never_reaches_the_altitude_is_none() -> None:
    assert split(Grid(2.0, 4, 3, (-1.0, -1.0), 50.0, waypoints=(3, 0)), BOTH, 1.0) == ()


def test_flights_of_a_policy_are_left_out() -> None:
    before = BOTH._replace(policy=by_policy(1.0, 60.0))
    assert [f.window_ns[0] for f in split(GRID, before, 1.0)] == [SECOND_NS + 4 * NS]
    afterwards = BOTH._replace(policy=by_policy(27.0, 60.0))
    assert len(demonstrations_of(GRID, afterwards, SETTINGS).demonstrations) == 2  # The final waypoint came first.
    amid = demonstrations_of(GRID, BOTH._replace(policy=by_policy(10.0, 60.0)), SETTINGS)
    assert len(amid.demonstrations) == 1 and 'a policy took over' in amid.notes[0]


def test_a_hop_in_place_is_no_demonstration() -> None:
    found = demonstrations_of(GRID, flight(GRID, [0, 0]), SETTINGS)
    assert found.demonstrations == () and 'no move from cell to cell' in found.notes[0]


def test_the_whole_recording_as_one_flight() -> None:
    (only,) = demonstrations_of(GRID, BOTH, SETTINGS, undivided=True).demonstrations
    assert only.end_reason is EndReason.FINAL_WAYPOINT and only.audit.notes
    unstamped = Recording(PoseSamples(np.zeros(2, dtype=np.int64), np.zeros((2, 3))))
    assert demonstrations_of(GRID, unstamped, SETTINGS, undivided=True).demonstrations == ()


def test_waypoints_reached_are_counted() -> None:
    first, second = demonstrations_of(GRID, BOTH, SETTINGS, first=7).demonstrations
    assert (first.demonstration_id, waypoints_reached(first)) == ('flight-007', 3)
    assert waypoints_reached(second) == 0  # It ends in the first waypoint, where no action follows.


def test_cutting_loses_nothing_of_the_window() -> None:
    stamps = np.array([5, 3, 0, 4, 9, 6, 12, 7], dtype=np.int64)
    recording = Recording(PoseSamples(stamps, np.arange(24.0).reshape(8, 3)), NO_COMMANDS)
    assert Cutter(recording).cut((4, 7)).poses.stamps_ns.tolist() == stamps.tolist()
    assert Cutter(recording).cut((9, 11)).poses.stamps_ns.tolist() == [9, 6, 12, 7]
    assert Cutter(recording).cut((13, 20)).poses.stamps_ns.tolist() == []
