"""The live recorder without a node: what it gives equals the pure function, however the samples arrive."""

import numpy as np
import pytest

from advise_ros.core.demonstrations.demonstration import CLIMB_MISSED, Demonstration, EndReason
from advise_ros.core.demonstrations.discretise import DiscretiseSettings, discretise
from advise_ros.core.demonstrations.live_samples import KEEP
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of
from advise_ros.core.demonstrations.recorder import SETTLE_S, Recorder, RecorderPhase
from advise_ros.core.demonstrations.samples import Arrivals, Recording, VehicleEvent
from advise_ros.core.grid.grid import Action
from advise_ros.core.units import NS
from support.flown import GRID, PERIOD_NS, START_NS, flight, joined, round_trip

SETTINGS = DiscretiseSettings()
SECOND_NS = 5000 * NS
BOTH = joined(flight(GRID, round_trip()), flight(GRID, round_trip()[:4], SECOND_NS))


def recorder(*, by_flights: bool = True) -> Recorder:
    return Recorder(GRID, SETTINGS, BOTH.source, by_flights=by_flights)


def play(into: Recorder, recording: Recording, delays_ns: tuple[int, int, int] = (0, 0, 0)) -> list[Demonstration]:
    """Feed events, poses and commands, each kind late by its delay; polls ten times a second of the stamps."""
    entries = [
        *((event.stamp_ns + delays_ns[0], 0, event.stamp_ns, event) for event in recording.events),
        *((int(stamp) + delays_ns[1], 1, int(stamp), v) for stamp, v in zip(*recording.poses, strict=True)),
        *((int(stamp) + delays_ns[2], 2, int(stamp), v) for stamp, v in zip(*recording.commands, strict=True)),
    ]
    found = []
    for at_ns, kind, stamp_ns, value in sorted(entries, key=lambda entry: entry[:3]):
        if kind == 0:
            into.vehicle(value)
        else:
            (into.pose if kind == 1 else into.command)(stamp_ns, tuple(value.tolist()))
        found += [output.demonstration for output in into.take(at_ns / NS) if output.demonstration]
    for wait_s in (1, 2, 3):
        found += [output.demonstration for output in into.take(at_ns / NS + wait_s) if output.demonstration]
    return found


@pytest.mark.parametrize('delays_s', [(0, 0, 0), (0, 0, 0.15), (0.15, 0, 0), (0, 0.15, 0), (0.19, 0.1, 0)])
def test_late_arrival_changes_nothing(delays_s: tuple[float, float, float]) -> None:
    expected = demonstrations_of(GRID, BOTH, SETTINGS).demonstrations
    delays_ns = tuple(int(delay * NS) for delay in delays_s)
    assert tuple(play(recorder(), BOTH, delays_ns)) == expected  # type: ignore[arg-type]


@pytest.mark.parametrize('stamps', ['none', 'ahead', 'behind'])
def test_commands_of_another_clock_count_from_when_they_arrive(stamps: str) -> None:
    """Live and from a recording that knows the order of arrival."""
    own_ns = BOTH.commands.stamps_ns
    commands_ns = {'none': 0 * own_ns, 'ahead': own_ns + 10**18, 'behind': own_ns - 900 * NS}[stamps]
    arrived = np.searchsorted(BOTH.poses.stamps_ns, BOTH.commands.stamps_ns, side='right')
    states = np.searchsorted(BOTH.poses.stamps_ns, [event.stamp_ns for event in BOTH.events])
    recording = BOTH._replace(
        commands=BOTH.commands._replace(stamps_ns=commands_ns), arrivals=Arrivals(arrived, states, np.empty(0, dtype=np.int64)),
    )
    expected = demonstrations_of(GRID, recording, SETTINGS).demonstrations
    into, found = recorder(), []
    for index, (stamp_ns, position) in enumerate(zip(*BOTH.poses, strict=True)):
        for event, at in zip(BOTH.events, states, strict=True):
            if at == index:
                into.vehicle(event)
        into.pose(int(stamp_ns), tuple(position.tolist()))
        into.command(int(commands_ns[index]), tuple(BOTH.commands.velocities_enu_m_s[index].tolist()))
        found += [output.demonstration for output in into.take(stamp_ns / NS) if output.demonstration]
    for event in BOTH.events[sum(states < len(BOTH.poses.stamps_ns)) :]:
        into.vehicle(event)
    for wait_s in (1, 2, 3):
        found += [output.demonstration for output in into.take(stamp_ns / NS + wait_s) if output.demonstration]
    assert tuple(found) == expected and len(expected) == 2
    as_stamped = demonstrations_of(GRID, BOTH, SETTINGS).demonstrations
    assert [one.actions for one in expected] == [one.actions for one in as_stamped]
    assert [one.audit.ambiguous_actions for one in expected] == [one.audit.ambiguous_actions for one in as_stamped]


def test_each_demonstration_is_discretise_of_its_own_window() -> None:
    for found in play(recorder(), BOTH):
        assert found == discretise(GRID, BOTH, found.window_ns, SETTINGS, found.demonstration_id, found.end_reason)


def test_without_states_the_altitude_tells() -> None:
    blind = BOTH._replace(events=())
    assert [d.states for d in play(recorder(), blind)] == [d.states for d in play(recorder(), BOTH)]


def test_a_long_wait_on_the_ground_is_forgotten() -> None:
    into = recorder()
    for index in range(10 * KEEP):
        into.pose(index + 1, (0.0, 0.0, 0.0))
    assert len(into._samples.poses) <= 2 * KEEP
    assert len(play(into, BOTH)) == 2


def test_one_demonstration_a_take_off() -> None:
    twice = flight(GRID, [*round_trip(), *round_trip()])
    assert len(play(recorder(), twice)) == 1


def test_a_policy_in_the_air_records_nothing() -> None:
    into = recorder()
    into.policy(flies=True)
    assert play(into, flight(GRID, round_trip())) == []
    into.policy(flies=False)
    assert len(play(into, flight(GRID, round_trip(), SECOND_NS))) == 1


def test_a_policy_that_takes_over_ends_the_flight_without_a_demonstration() -> None:
    into = recorder()
    half = flight(GRID, round_trip()[:5], landing=False)
    play(into, half)
    assert into.phase is RecorderPhase.OPEN
    into.policy(flies=True)
    outputs = into.take(1e6) + into.take(1e6 + 1.0)
    assert [output.demonstration for output in outputs] == [None] and 'took over' in outputs[0].remark
    into.policy(flies=False)
    assert into.phase is RecorderPhase.IDLE


def test_by_hand() -> None:
    into = recorder(by_flights=False)
    assert not into.stop().success and not into.discard().success
    assert into.start().success and not into.start().success
    assert play(into, flight(GRID, round_trip()[:4], landing=False)) == []
    reply = into.stop()
    assert reply.success and 'flight-001 with 3 moves' in reply.message
    into.take(0.0)
    (output,) = into.take(SETTLE_S)
    assert output.demonstration is not None and output.demonstration.end_reason is EndReason.STOPPED
    assert not into.stop().success and 'flight-001 was published' in into.stop().message


def test_by_hand_it_ends_by_itself_at_the_final_waypoint() -> None:
    into = recorder(by_flights=False)
    into.start()
    (found,) = play(into, flight(GRID, round_trip()))
    assert found.end_reason is EndReason.FINAL_WAYPOINT and into.phase is RecorderPhase.IDLE


def test_stopping_without_moves_publishes_nothing() -> None:
    into = recorder(by_flights=False)
    into.start()
    reply = into.stop()
    assert not reply.success and 'no move' in reply.message and into.phase is RecorderPhase.IDLE


def test_discard_drops_the_running_one_and_then_takes_back_the_last() -> None:
    into = recorder()
    play(into, BOTH)
    into.start()
    assert 'flight-003 is dropped' in into.discard().message
    for expected in ('flight-002', 'flight-001'):
        assert f'{expected} is taken back' in into.discard().message
        (output,) = into.take(0.0)
        assert output.demonstration is not None
        assert (output.demonstration.demonstration_id, output.demonstration.states) == (expected, ())
    assert not into.discard().success
    assert into.next_id == 'flight-003'  # Ids are not used twice.


def test_any_demonstration_is_taken_back_by_its_id() -> None:
    into = recorder()
    play(into, BOTH)
    assert 'flight-001 is taken back' in into.take_back('flight-001').message
    (output,) = into.take(0.0)
    assert output.demonstration is not None
    assert (output.demonstration.demonstration_id, output.demonstration.states) == ('flight-001', ())
    assert into.take_back('flight-001') == (False, "'flight-001' was not published by this recorder; published: flight-002")
    assert 'flight-002 is taken back' in into.discard().message


def test_nan_and_repeated_stamps_do_not_disturb() -> None:
    recording = flight(GRID, round_trip())
    recording.poses.positions_enu_m[80] = np.nan
    recording.poses.stamps_ns[90] = recording.poses.stamps_ns[89]
    (found,) = play(recorder(), recording._replace(events=()))
    assert found.audit.late == 1 and found.audit.notes and found.end_reason is EndReason.FINAL_WAYPOINT


def test_a_clock_set_back_ends_the_flight_under_way_and_starts_afresh() -> None:
    into = recorder()
    play(into, flight(GRID, round_trip()[:4], SECOND_NS, landing=False)._replace(events=()))
    before, found = play(into, flight(GRID, round_trip(), START_NS)._replace(events=()))
    assert before.end_reason is EndReason.END_OF_LOG and before.actions == (Action.EAST,) * 3
    assert found.window_ns[0] == START_NS + 4 * NS and found.audit.late == 0


@pytest.mark.parametrize('ahead_s', [5.0, 3.2e7, -20.0])
def test_one_pose_with_a_wild_stamp_neither_ends_nor_spoils_the_recording(ahead_s: float) -> None:
    clean, wild = flight(GRID, round_trip()), flight(GRID, round_trip())
    wild.poses.stamps_ns[120] += int(ahead_s * NS)
    into, found = recorder(), []
    for index, at_ns in enumerate(clean.poses.stamps_ns.tolist()):
        for event in wild.events:
            if at_ns - PERIOD_NS < event.stamp_ns <= at_ns:
                into.vehicle(event)
        into.pose(int(wild.poses.stamps_ns[index]), tuple(wild.poses.positions_enu_m[index].tolist()))
        into.command(at_ns, tuple(wild.commands.velocities_enu_m_s[index].tolist()))
        found += [output.demonstration for output in into.take(at_ns / NS) if output.demonstration]
    assert tuple(found) == demonstrations_of(GRID, wild, SETTINGS).demonstrations
    (found,) = found
    assert found.states == play(recorder(), clean)[0].states
    assert found.audit.late == 1 and '1 positions have stamps far from the others and were not used' in found.audit.notes


def test_a_bridge_that_restarts_says_nothing_of_the_vehicle() -> None:
    """Its first states have no link, then one without knowledge of the air; what the restart cuts off is no new flight."""
    recording = flight(GRID, round_trip())
    lost = [
        VehicleEvent(START_NS + 9 * NS, False, False, connected=False), VehicleEvent(START_NS + 11 * NS, True, False),
        VehicleEvent(START_NS + 12 * NS, True, True),
    ]
    events = tuple(sorted((*recording.events, *lost), key=lambda event: event.stamp_ns))
    (found,) = play(recorder(), recording._replace(events=events))
    assert found.end_reason is EndReason.FINAL_WAYPOINT
    half = flight(GRID, round_trip()[:7])
    cut_off = half._replace(events=tuple(sorted((*half.events, *lost), key=lambda event: event.stamp_ns)))
    into = recorder()
    assert play(into, cut_off) == []
    assert 'the link to the vehicle was lost 5.0 s into it' in demonstrations_of(GRID, cut_off, SETTINGS).notes[0]


def test_a_vehicle_pushed_elsewhere_than_commanded_is_told_at_once() -> None:
    recording = flight(GRID, round_trip())
    east = np.abs(recording.poses.positions_enu_m[:, 0] - 2.0) < 0.95
    recording.commands.velocities_enu_m_s[east & (recording.commands.stamps_ns < START_NS + 12 * NS)] = (0.0, 1.0, 0.0)
    into, told = recorder(), []
    stamps = recording.poses.stamps_ns
    vectors = recording.poses.positions_enu_m, recording.commands.velocities_enu_m_s
    for stamp, position, velocity in zip(stamps.tolist(), *vectors, strict=True):
        into.pose(stamp, tuple(position.tolist()))
        into.command(stamp, tuple(velocity.tolist()))
        told += [(stamp, output.remark) for output in into.take(stamp / NS) if output.warning]
    ((at_ns, remark),) = told
    assert 'went EAST from cell [1, 0] while NORTH was commanded' in remark
    left_ns = int(stamps[recording.poses.positions_enu_m[:, 0] > 3.2][0])
    assert 0 <= at_ns - left_ns <= (SETTLE_S + 0.1) * NS


def test_a_policy_is_recorded_when_it_is_asked_for() -> None:
    into = Recorder(GRID, SETTINGS, BOTH.source, by_flights=True, policy_flights=True)
    into.policy(flies=True)
    assert len(play(into, flight(GRID, round_trip()))) == 1


@pytest.mark.parametrize('states_known', [True, False])
def test_a_flight_whose_climb_was_not_heard_is_noted_and_the_next_is_not(states_known: bool) -> None:
    begin_ns = START_NS + 10 * NS
    late = BOTH._replace(
        poses=type(BOTH.poses)(*(column[BOTH.poses.stamps_ns >= begin_ns] for column in BOTH.poses)),
        events=BOTH.events if states_known else (),
    )
    noted, clean = play(recorder(), late)
    assert noted.audit.notes[0] == CLIMB_MISSED and CLIMB_MISSED not in clean.audit.notes


def test_a_state_that_is_heard_late_takes_nothing_from_a_flight() -> None:
    """It is latched, one deep: who comes late hears of the air only, though the climb was heard."""
    late = BOTH._replace(events=tuple(event for event in BOTH.events if event.stamp_ns >= START_NS + 5 * NS))
    assert play(recorder(), late)[0].audit.notes == play(recorder(), BOTH)[0].audit.notes


def test_numbers_go_on_after_those_that_others_hold() -> None:
    into = recorder()
    for held in ('flight-007', 'flight-003', 'grid-model-9', 'flight-x', 'flight-'):
        into.skip_number(held)
    assert [found.demonstration_id for found in play(into, BOTH)] == ['flight-008', 'flight-009']
