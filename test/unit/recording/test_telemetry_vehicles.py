"""Whose positions are in a telemetry log: second links, several vehicles, clocks that are set, states that fall silent."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.recorded_flights import Demonstrations, demonstrations_of
from advise_ros.core.demonstrations.samples import Recording
from advise_ros.core.errors import LogError
from advise_ros.core.units import NS
from advise_ros.mavlink.messages import dialect
from advise_ros.recording.tlog import read_tlog
from support.flown import GRID, START_NS, flight, joined, round_trip

OTHER_ROUTE = round_trip()[:4]
FLOWN, OTHER = flight(GRID, round_trip()), flight(GRID, OTHER_ROUTE)
ARMED = dialect.MAV_MODE_FLAG_SAFETY_ARMED


class Sent(NamedTuple):
    """A message and when it was logged."""

    log_ns: int
    message: Any
    system: int = 1


def sent(flown: Recording, system: int = 1, boot_ms: int = 100_000, later_ns: int = 0) -> list[Sent]:
    """Positions, commands to it, and its state once a second; logged as stamped, or later."""
    begin_ns = int(flown.poses.stamps_ns[0])
    rows = []
    for index, (stamp_ns, (east, north, up)) in enumerate(zip(*flown.poses, strict=True)):
        time_ms = boot_ms + (int(stamp_ns) - begin_ns) // 10**6
        rows.append((stamp_ns, dialect.MAVLink_local_position_ned_message(time_ms, north, east, -up, 0, 0, 0)))
        if index % 10 == 0:
            armed, in_air = up > 0.0, 2 if up > 0.1 else 1
            rows.append((stamp_ns, dialect.MAVLink_heartbeat_message(2, 3, ARMED if armed else 0, 4, 4, 3)))
            rows.append((stamp_ns, dialect.MAVLink_extended_sys_state_message(0, in_air)))
    found = [Sent(int(stamp_ns) + later_ns, message, system) for stamp_ns, message in rows]
    for stamp_ns, (east, north, up) in zip(*flown.commands, strict=True):
        velocity = dialect.MAVLink_set_position_target_local_ned_message(
            0, system, 1, 1, 0x5C7, 0, 0, 0, north, east, -up, 0, 0, 0, 0, 0,
        )
        found.append(Sent(int(stamp_ns), velocity, 255))
    return found


def states_of(rows: Iterable[Sent]) -> list[Sent]:
    return [row for row in rows if row.message.get_type() in ('HEARTBEAT', 'EXTENDED_SYS_STATE')]


def log(path: Path, rows: Iterable[Sent], *, in_order: bool = True) -> Path:
    codecs: dict[int, Any] = {}
    ordered = sorted(rows, key=lambda row: row.log_ns) if in_order else rows
    with path.open('wb') as file:
        for log_ns, message, system in ordered:
            codec = codecs.setdefault(system, dialect.MAVLink(None, system, 1))
            file.write((log_ns // 1000).to_bytes(8, 'big') + bytes(message.pack(codec)))
    return path


def demonstrations(recording: Recording) -> Demonstrations:
    return demonstrations_of(GRID, recording, DiscretiseSettings())


def actions(recording: Recording) -> list[tuple[int, ...]]:
    return [one.actions for one in demonstrations(recording).demonstrations]


EXPECTED, OTHER_EXPECTED = actions(FLOWN)[0], actions(OTHER)[0]


# -- second links ----------------------------------------------------------------------------------
@pytest.mark.parametrize('late_s', [0.04, 1.3, 9.0])
def test_what_a_second_link_brings_again_is_not_used(tmp_path: Path, late_s: float) -> None:
    """Old states that come again do not end the flight either."""
    flown = joined(FLOWN, flight(GRID, round_trip(), start_ns=START_NS + 200 * NS))
    again = [row for row in sent(flown, later_ns=round(late_s * NS)) if row.system == 1]
    found = read_tlog(log(tmp_path / 'two_links.tlog', [*sent(flown), *again]))
    assert (found.poses.stamps_ns == flown.poses.stamps_ns).all()
    assert actions(found) == [EXPECTED, EXPECTED]
    assert [one.audit.late for one in demonstrations(found).demonstrations] == [0, 0]
    (note,) = found.notes
    assert note.startswith(f'{len(flown.poses.stamps_ns)} positions came again, up to {late_s:.1f} s late, by a second link')


def test_a_second_link_fills_the_gaps_of_the_first(tmp_path: Path) -> None:
    rows = sent(FLOWN)
    lost = [row for index, row in enumerate(rows) if row.system == 255 or index % 3]
    found = read_tlog(log(tmp_path / 'gaps.tlog', [*lost, *sent(FLOWN, later_ns=NS // 50)]))
    assert len(found.poses.stamps_ns) == len(FLOWN.poses.stamps_ns) and actions(found) == [EXPECTED]


# -- several vehicles ------------------------------------------------------------------------------
def test_the_vehicle_that_flies_is_taken_or_the_one_named(tmp_path: Path) -> None:
    ground = [
        Sent(START_NS + index * NS // 30, dialect.MAVLink_local_position_ned_message(index * 33, 0, 0, 0, 0, 0, 0), 2)
        for index in range(3000)
    ]
    path = log(tmp_path / 'two.tlog', [*sent(FLOWN), *ground])
    found = read_tlog(path)
    assert actions(found) == [EXPECTED] and found.source == f'{path} (positions of vehicle 1)'
    assert found.notes == ('positions of vehicle 1 were taken, those of 2 not (--vehicle)',)
    assert len(read_tlog(path, vehicle='2').poses.stamps_ns) == len(ground)
    with pytest.raises(LogError, match="has positions of vehicle 1, 2, not of '3'; name one"):
        read_tlog(path, vehicle='3')


@pytest.mark.parametrize('boots_ms', [(100_000, 5_000), (100_000, 98_000)])
def test_vehicles_that_share_a_system_id_are_separated_by_their_time_since_boot(
    tmp_path: Path, boots_ms: tuple[int, int],
) -> None:
    """Nobody knows whose the commands and states are."""
    path = log(tmp_path / 'same.tlog', [*sent(FLOWN, boot_ms=boots_ms[0]), *sent(OTHER, boot_ms=boots_ms[1])])
    for vehicle, flown in (('1a', FLOWN), ('1b', OTHER)):
        found = read_tlog(path, vehicle=vehicle)
        assert (found.poses.stamps_ns == flown.poses.stamps_ns).all()
        assert not found.events and not len(found.commands.stamps_ns)
        assert any('several vehicles send as system 1' in note for note in found.notes)
    assert read_tlog(path).source.endswith('(positions of vehicle 1a)')


# -- clocks ----------------------------------------------------------------------------------------
@pytest.mark.parametrize('boot_ms', [5_000, 100_000, 170_000])
def test_a_reboot_between_two_flights_makes_no_second_vehicle(tmp_path: Path, boot_ms: int) -> None:
    second = flight(GRID, OTHER_ROUTE, start_ns=START_NS + 200 * NS)
    found = read_tlog(log(tmp_path / 'reboot.tlog', [*sent(FLOWN), *sent(second, boot_ms=boot_ms)]))
    assert actions(found) == [EXPECTED, OTHER_EXPECTED] and not found.notes


@pytest.mark.parametrize('boot_ms', [110_000, 5_000])
def test_flights_that_overlap_since_the_clock_was_set_back_are_two(tmp_path: Path, boot_ms: int) -> None:
    """Whether or not the time since boot goes back as well."""
    rows = [sorted(sent(FLOWN), key=lambda row: row.log_ns), sorted(sent(OTHER, boot_ms=boot_ms), key=lambda row: row.log_ns)]
    later = [row._replace(log_ns=row.log_ns + 10 * NS) for row in rows[1]]
    found = read_tlog(log(tmp_path / 'set_back.tlog', [*rows[0], *later], in_order=False))
    assert actions(found) == [EXPECTED, OTHER_EXPECTED]
    assert any('the clock goes back' in note for note in demonstrations(found).notes)


# -- states ----------------------------------------------------------------------------------------
@pytest.mark.parametrize('known', ['first', 'second', 'none'])
def test_states_that_begin_late_or_fall_silent_lose_no_flight(tmp_path: Path, known: str) -> None:
    second = sent(flight(GRID, OTHER_ROUTE, start_ns=START_NS + 200 * NS), boot_ms=300_000)
    flights = {'first': sent(FLOWN), 'second': second}
    rows = [row for name, of in flights.items() for row in of if name == known or row not in states_of(of)]
    found = read_tlog(log(tmp_path / 'silent.tlog', rows))
    assert actions(found) == [EXPECTED, OTHER_EXPECTED]


def test_positions_whose_time_since_boot_stands_still_are_all_used(tmp_path: Path) -> None:
    rows = sent(FLOWN)
    for row in rows:
        if row.message.get_type() == 'LOCAL_POSITION_NED':
            row.message.time_boot_ms = 0
    found = read_tlog(log(tmp_path / 'zero.tlog', rows))
    assert np.array_equal(found.poses.stamps_ns, FLOWN.poses.stamps_ns) and actions(found) == [EXPECTED]
