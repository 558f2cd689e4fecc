"""The demonstrations of a whole recording; core/demonstrations/recorder.py makes the same of samples as they come in."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from advise_ros.core.demonstrations.audit_notes import beginning_unheard
from advise_ros.core.demonstrations.demonstration import Demonstration, EndReason
from advise_ros.core.demonstrations.discretise import DiscretiseSettings, discretise
from advise_ros.core.demonstrations.epochs import divide
from advise_ros.core.demonstrations.flight_windows import Bands, Event, Flight, Segmenter, order
from advise_ros.core.demonstrations.samples import Recording
from advise_ros.core.demonstrations.slices import Cutter
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import NS


class Demonstrations(NamedTuple):
    """What a recording gives, and one sentence about each flight that gives none, and on clocks."""

    demonstrations: tuple[Demonstration, ...]
    notes: tuple[str, ...]


class Flown(NamedTuple):
    """A flight, and the part of its recording (of one clock) that it lies in."""

    flight: Flight
    part: Recording


def demonstrations_of(
    grid: Grid,
    recording: Recording,
    settings: DiscretiseSettings,
    *,
    first: int = 1,
    undivided: bool = False,
    policy_flights: bool = False,
) -> Demonstrations:
    """All demonstrations of a recording, with ids 'flight-001' and so on from number `first`.

    Args:
        first: number of the first demonstration.
        undivided: take the whole recording as one flight.
        policy_flights: take flights of a policy as demonstrations, too.

    Raises:
        InputError: the hysteresis is not below half a cell.
    """
    kept: list[Demonstration] = []
    epochs = divide(recording)
    notes = list(epochs.notes)
    begin_ns = next((int(stamp_ns) for stamp_ns in recording.poses.stamps_ns if stamp_ns > 0), 0)
    flights = map(_whole, epochs.parts) if undivided else [
        _split(grid, epochs.parts, settings.altitude_tolerance_m, policy_flights=policy_flights)
    ]
    for flight, part in (one for several in flights for one in several):
        found = demonstration_of(grid, part, flight, settings, name(first + len(kept)))
        reason = why_not(found, flight, manual=False)
        if reason:
            begin_s = (flight.window_ns[0] - begin_ns) / NS
            notes.append(f'the flight {begin_s:.1f} s after the first position is no demonstration: {reason}')
        else:
            kept.append(found)
    return Demonstrations(tuple(kept), tuple(notes))


def demonstration_of(
    grid: Grid, part: Recording, flight: Flight, settings: DiscretiseSettings, demonstration_id: str,
) -> Demonstration:
    """What a flight becomes; the part may hold more than the flight."""
    found = discretise(grid, part, flight.window_ns, settings, demonstration_id, flight.end_reason)
    return beginning_unheard(found) if flight.unheard else found


def name(number: int) -> str:
    """Id of the demonstration with this number, counted from 1."""
    return f'flight-{number:03}'


def number_of(demonstration_id: str) -> int:
    """The number in an id that `name` gave, 0 for other ids."""
    number = demonstration_id.removeprefix('flight-')
    return int(number) if number != demonstration_id and number.isdecimal() and number.isascii() else 0


def why_not(demonstration: Demonstration, flight: Flight, *, manual: bool) -> str:
    """Why a flight gives no demonstration, '' if it does; `manual`: a person said when it ends."""
    if not demonstration.states:
        return '; '.join(('it has no move from cell to cell', *demonstration.audit.notes))
    if manual or demonstration.end_reason is EndReason.FINAL_WAYPOINT:
        return ''
    if demonstration.end_reason is EndReason.STOPPED:
        return 'a policy took over before the final waypoint'
    if flight.lost_ns >= 0:
        after_s = (flight.lost_ns - flight.window_ns[0]) / NS
        lost = f'the link to the vehicle was lost {after_s:.1f} s into it, before the final waypoint'
        return f'{lost}: its bridge ended or was cut off'
    return ''


def waypoints_reached(demonstration: Demonstration) -> int:
    """How many waypoints, in their order, the vehicle entered."""
    grid = demonstration.grid
    if demonstration.end_reason == EndReason.FINAL_WAYPOINT:
        return grid.n_layers
    return grid.next_waypoint(demonstration.states[-1]) if demonstration.states else 0


def split(
    grid: Grid, recording: Recording, altitude_tolerance_m: float, *, policy_flights: bool = False,
) -> tuple[Flown, ...]:
    """The flights of a recording, in order, without those that a policy flew (see Segmenter)."""
    return tuple(_split(grid, divide(recording).parts, altitude_tolerance_m, policy_flights=policy_flights))


def _split(
    grid: Grid, parts: tuple[Recording, ...], altitude_tolerance_m: float, *, policy_flights: bool,
) -> Iterator[Flown]:
    segmenter, bands = Segmenter(policy_flights=policy_flights), Bands(grid, altitude_tolerance_m)
    for index, part in enumerate(parts):
        cutter = Cutter(part)
        newest_ns = int(part.poses.stamps_ns.max(initial=0))
        bands.restart()
        changes = bands.take(part.poses.stamps_ns, part.poses.positions_enu_m[:, 2])
        events: list[Event] = [*part.events, *part.policy, *changes]
        ended = [segmenter.take(event) for event in sorted(events, key=order)]
        ended.append(segmenter.end(newest_ns) if index == len(parts) - 1 else segmenter.new_epoch(newest_ns))
        for flight in ended:
            if flight is not None:
                yield Flown(flight, cutter.cut(flight.window_ns))


def _whole(part: Recording) -> Iterator[Flown]:
    """All of a recording as one flight; none where nothing is stamped."""
    stamps_ns = part.poses.stamps_ns[part.poses.stamps_ns > 0]
    if stamps_ns.size:
        yield Flown(Flight((int(stamps_ns.min()), int(stamps_ns.max())), EndReason.END_OF_LOG), part)

