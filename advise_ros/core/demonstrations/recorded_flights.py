"""The demonstrations of a whole recording; core/demonstrations/recorder.py makes the same of samples as they come in."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.demonstration import Demonstration, EndReason, with_missed_climb
from advise_ros.core.demonstrations.discretise import DiscretiseSettings, discretise
from advise_ros.core.demonstrations.epochs import divide
from advise_ros.core.demonstrations.flight_windows import Bands, Event, Flight, Segmenter, order
from advise_ros.core.demonstrations.samples import NEVER_NS, CommandSamples, PoseSamples, Recording
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import NS


class Cutter:
    """Cuts in O(log n); samples may have arrived in any order."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._poses = _Index(recording.poses.stamps_ns)
        self._commands = _Index(recording.commands.stamps_ns)
        stamped = recording.commands.stamps_ns[recording.commands.stamps_ns > 0]
        self._commanded_ns = int(stamped.min()) if stamped.size else NEVER_NS

    def cut(self, window_ns: tuple[int, int]) -> Recording:
        """All samples with a stamp in the window, both ends included, and what arrived between them.

        From the first arrival that is not older than the window to the last that is not newer; the views
        share the recording's memory.

        Args:
            window_ns: first and last stamp.
        """
        poses, commands = self._poses.between(window_ns), self._commands.between(window_ns)
        whole = self._recording
        return whole._replace(
            commanded_ns=min(whole.commanded_ns, self._commanded_ns),
            poses=PoseSamples(whole.poses.stamps_ns[poses], whole.poses.positions_enu_m[poses]),
            commands=CommandSamples(whole.commands.stamps_ns[commands], whole.commands.velocities_enu_m_s[commands]),
        )


class _Index:
    """The newest stamp up to each arrival and the oldest one from it on: both ascend."""

    def __init__(self, stamps_ns: npt.NDArray[np.int64]) -> None:
        self._newest = np.maximum.accumulate(stamps_ns)
        stamped = np.where(stamps_ns <= 0, NEVER_NS, stamps_ns)
        self._oldest = np.minimum.accumulate(stamped[::-1])[::-1]

    def between(self, window_ns: tuple[int, int]) -> slice:
        first = int(np.searchsorted(self._newest, window_ns[0], side='left'))
        after = int(np.searchsorted(self._oldest, min(window_ns[1], NEVER_NS - 1), side='right'))
        return slice(first, max(first, after))


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
    return with_missed_climb(found) if flight.climb_missed else found


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
    """The flights of a recording, in order, without those that a policy flew (see Segmenter).

    Args:
        grid: its altitude decides where a flight is on its route.
        recording: positions and states of the vehicle.
        altitude_tolerance_m: how far off the grid's altitude the route may be flown.
        policy_flights: keep flights of a policy, too.
    """
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
