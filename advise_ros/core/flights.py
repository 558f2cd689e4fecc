"""When a flight along the route began and ended: from the vehicle's state where it is known, else from altitude."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.cut import Cutter
from advise_ros.core.demonstration import Demonstration, EndReason
from advise_ros.core.discretise import DiscretiseSettings, discretise
from advise_ros.core.grid import Grid
from advise_ros.core.samples import PoseSamples, Recording, VehicleEvent

NS = 1_000_000_000
# Shares of the grid's altitude: above the first a climb may be over, below the second a flight is.
UP_SHARE, DOWN_SHARE = 0.75, 0.5


class Flight(NamedTuple):
    """A window of stamps, both ends included, and why it ended.

    STOPPED means that a policy took over.
    """

    window_ns: tuple[int, int]
    end_reason: EndReason


class Demonstrations(NamedTuple):
    """What a recording gives, and one sentence about each flight that gives none."""

    demonstrations: tuple[Demonstration, ...]
    notes: tuple[str, ...]


def demonstrations_of(
    grid: Grid, recording: Recording, settings: DiscretiseSettings, *, first: int = 1, undivided: bool = False,
) -> Demonstrations:
    """All demonstrations of a recording, with ids 'flight-001' and so on from number `first`.

    Args:
        first: number of the first demonstration.
        undivided: take the whole recording as one flight.

    Raises:
        InputError: the hysteresis is not below half a cell.
    """
    kept: list[Demonstration] = []
    notes: list[str] = []
    cutter = Cutter(recording)
    for flight in whole(recording) if undivided else split(grid, recording, settings.altitude_tolerance_m):
        part = cutter.cut(flight.window_ns)
        found = discretise(grid, part, flight.window_ns, settings, name(first + len(kept)), flight.end_reason)
        reason = why_not(found, manual=False)
        if reason:
            begin_s = (flight.window_ns[0] - int(recording.poses.stamps_ns[0])) / NS
            notes.append(f'the flight {begin_s:.1f} s after the first position is no demonstration: {reason}')
        else:
            kept.append(found)
    return Demonstrations(tuple(kept), tuple(notes))


def name(number: int) -> str:
    """Id of the demonstration with this number, counted from 1."""
    return f'flight-{number:03}'


def number_of(demonstration_id: str) -> int:
    """The number in an id that `name` gave, 0 for other ids."""
    number = demonstration_id.removeprefix('flight-')
    return int(number) if number != demonstration_id and number.isdecimal() and number.isascii() else 0


def why_not(demonstration: Demonstration, *, manual: bool) -> str:
    """Why a flight gives no demonstration, '' if it does; `manual`: a person said when it ends."""
    if not demonstration.states:
        return '; '.join(('it has no move from cell to cell', *demonstration.audit.notes))
    if demonstration.end_reason == EndReason.STOPPED and not manual:
        return 'a policy took over before the final waypoint'
    return ''


def waypoints_reached(demonstration: Demonstration) -> int:
    """How many waypoints, in their order, the vehicle entered."""
    grid = demonstration.grid
    if demonstration.end_reason == EndReason.FINAL_WAYPOINT:
        return grid.n_layers
    return grid.next_waypoint(demonstration.states[-1]) if demonstration.states else 0


def flown_altitude_m(grid: Grid, altitude_tolerance_m: float) -> float:
    """A climbing vehicle at this altitude begins its route."""
    return max(grid.altitude_m - altitude_tolerance_m, UP_SHARE * grid.altitude_m)


def landed_altitude_m(grid: Grid) -> float:
    """Below this altitude a flight is over, where nothing else tells."""
    return DOWN_SHARE * grid.altitude_m


def split(grid: Grid, recording: Recording, altitude_tolerance_m: float) -> tuple[Flight, ...]:
    """The flights of a recording, in order, without those that a policy flew.

    A flight begins with the first sample at the grid's altitude after take-off and ends when the vehicle
    lands or disarms; without vehicle events, when it sinks below half the grid's altitude. A flight that a
    policy takes over ends there; one that begins while a policy flies is not a demonstration.
    """
    times = _airborne(recording.events) if recording.events else _airborne_by_altitude(grid, recording.poses)
    cutter = Cutter(recording)
    up_m = flown_altitude_m(grid, altitude_tolerance_m)
    flights = (_from_altitude_on(_clean(cutter.cut(flight.window_ns).poses), up_m, flight) for flight in times)
    kept = (_before_policy(flight, recording.policy_ns) for flight in flights if flight is not None)
    return tuple(flight for flight in kept if flight is not None)


def whole(recording: Recording) -> tuple[Flight, ...]:
    """All of a recording as one flight; none where nothing is stamped."""
    stamps = _clean(recording.poses).stamps_ns
    if not stamps.size:
        return ()
    return (Flight((int(stamps.min()), int(stamps.max())), EndReason.END_OF_LOG),)


def _clean(poses: PoseSamples) -> PoseSamples:
    usable = (poses.stamps_ns != 0) & np.isfinite(poses.positions_enu_m[:, 2])
    return PoseSamples(poses.stamps_ns[usable], poses.positions_enu_m[usable])


def _airborne(events: tuple[VehicleEvent, ...]) -> list[Flight]:
    """From each take-off to the landing or disarming; a recording that ends in the air ends the last one."""
    flights: list[Flight] = []
    start_ns: int | None = None
    for event in events:
        flying = event.armed and event.in_air
        if flying and start_ns is None:
            start_ns = event.stamp_ns
        elif not flying and start_ns is not None:
            reason = EndReason.LANDED if event.armed else EndReason.DISARMED
            flights.append(Flight((start_ns, event.stamp_ns), reason))
            start_ns = None
    if start_ns is not None:
        flights.append(Flight((start_ns, np.iinfo(np.int64).max), EndReason.END_OF_LOG))
    return flights


def _airborne_by_altitude(grid: Grid, poses: PoseSamples) -> list[Flight]:
    clean = _clean(poses)
    up = clean.positions_enu_m[:, 2] >= landed_altitude_m(grid)
    edges = np.flatnonzero(np.diff(up.astype(np.int8), prepend=0, append=0))
    flights: list[Flight] = []
    for first, after in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        landed = after < len(up)
        end_ns = int(clean.stamps_ns[after if landed else after - 1])
        reason = EndReason.LANDED if landed else EndReason.END_OF_LOG
        flights.append(Flight((int(clean.stamps_ns[first]), end_ns), reason))
    return flights


def _from_altitude_on(poses: PoseSamples, up_m: float, flight: Flight) -> Flight | None:
    start_ns, end_ns = flight.window_ns
    flying = (poses.stamps_ns >= start_ns) & (poses.stamps_ns <= end_ns)
    high = flying & (poses.positions_enu_m[:, 2] >= up_m)
    if not high.any():
        return None
    first = int(poses.stamps_ns[np.argmax(high)])
    last = min(end_ns, int(poses.stamps_ns[flying].max()))
    return Flight((first, last), flight.end_reason) if first <= last else None


def _before_policy(flight: Flight, policy_ns: tuple[tuple[int, int], ...]) -> Flight | None:
    """The flight up to the policy's first flight in it; None when the policy flew from its beginning."""
    start_ns, end_ns = flight.window_ns
    taken_ns = [max(begin, start_ns) for begin, end in policy_ns if begin <= end_ns and end >= start_ns]
    if not taken_ns:
        return flight
    if min(taken_ns) == start_ns:
        return None
    return Flight((start_ns, min(taken_ns) - 1), EndReason.STOPPED)
