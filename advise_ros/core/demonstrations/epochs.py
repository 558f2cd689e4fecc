"""A recording whose clock was set back, divided into recordings whose stamps are of one clock each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.samples import (
    STRAY_NS,
    Arrivals,
    CommandSamples,
    PolicyEvent,
    PoseSamples,
    Recording,
    VehicleEvent,
)
from advise_ros.core.demonstrations.timeline import STEP_NS, Piece, Stamps, Timeline
from advise_ros.core.units import NS

# An event stamped further ahead of the positions that arrived with it is of another clock: it holds from them on. Less may
# be positions that wait in the queue of a recorder on a busy machine.
EVENT_AHEAD_NS = 60 * NS

EventT = TypeVar('EventT', VehicleEvent, PolicyEvent)


class Epochs(NamedTuple):
    """The parts of a recording, in order, and one sentence for each time that its clock was set back."""

    parts: tuple[Recording, ...]
    notes: tuple[str, ...]


def divide(recording: Recording) -> Epochs:
    """Split at backward steps of the positions' clock, before anything else looks at stamps.

    Strays among the positions get the stamp STRAY_NS. Commands and events go to the epoch in which they arrived, or to
    the next one where their stamps are behind already. Commands without a stamp, or far from the positions' clock, count from
    when they arrived.
    """
    timeline = Timeline()
    pieces = timeline.take(recording.poses.stamps_ns) + timeline.finish()
    where = _Where(recording.poses.stamps_ns, pieces)
    arrivals = _fitting(recording)
    if arrivals is not None:
        recording = recording._replace(
            events=where.holding(recording.events, arrivals.events), policy=where.holding(recording.policy, arrivals.policy),
            commands=recording.commands._replace(stamps_ns=where.counting(recording.commands.stamps_ns, arrivals.commands)),
        )
    if timeline.epoch == 0 and all(piece.sound for piece in pieces):
        return Epochs((recording._replace(events=in_order(recording.events), policy=in_order(recording.policy)),), ())
    commands_ns = recording.commands.stamps_ns
    of_commands = where.epochs(commands_ns, arrivals.commands if arrivals else None)
    events_ns, policy_ns = (np.array([one.stamp_ns for one in of], dtype=np.int64) for of in (recording.events, recording.policy))
    of_events = where.epochs(events_ns, arrivals.events if arrivals else None)
    of_policy = where.epochs(policy_ns, arrivals.policy if arrivals else None)
    parts = []
    for epoch in range(timeline.epoch + 1):
        rows, mine = where.rows(epoch), of_commands == epoch
        commands = CommandSamples(commands_ns[mine], recording.commands.velocities_enu_m_s[mine])
        parts.append(recording._replace(
            poses=PoseSamples(where.stamps_ns[rows], recording.poses.positions_enu_m[rows]),
            commands=commands,
            events=_of(epoch, recording.events, of_events),
            policy=_of(epoch, recording.policy, of_policy),
            arrivals=None,
            commanded_ns=0 if (of_commands < epoch).any() else recording.commanded_ns,
        ))
    return Epochs(tuple(parts), where.notes())


def _fitting(recording: Recording) -> Arrivals | None:
    """How the kinds interleave; None where samples were taken out since."""
    arrivals, most = recording.arrivals, len(recording.poses.stamps_ns)
    if arrivals is None:
        return None
    counts = len(recording.commands.stamps_ns), len(recording.events), len(recording.policy)
    fits = all(len(rows) == count and rows.max(initial=0) <= most for rows, count in zip(arrivals, counts, strict=True))
    return arrivals if fits else None


def place(stamp_ns: int, newest_ns: int) -> int:
    """How many epochs a stamp lies after the one whose newest position is `newest_ns`: 1 or 0.

    Args:
        stamp_ns: of a command or an event.
        newest_ns: newest stamp of the positions so far.
    """
    return int(0 < stamp_ns < newest_ns - STEP_NS)


def holds_from_ns(stamp_ns: int, newest_ns: int) -> int:
    """From which stamp on an event holds.

    Args:
        stamp_ns: its own; 0 where it has none.
        newest_ns: newest stamp of the positions that had arrived before it.
    """
    return newest_ns if newest_ns and (stamp_ns <= 0 or stamp_ns > newest_ns + EVENT_AHEAD_NS) else stamp_ns


def counts_from_ns(stamp_ns: int, newest_ns: int) -> int:
    """From which stamp on a command counts; one of another clock, or without a stamp, counts from when it arrived.

    Args:
        stamp_ns: its own; 0 where it has none.
        newest_ns: newest stamp of the positions that had arrived before it.
    """
    return newest_ns if newest_ns and (stamp_ns <= 0 or abs(stamp_ns - newest_ns) > EVENT_AHEAD_NS) else stamp_ns


def in_order(events: Sequence[EventT]) -> tuple[EventT, ...]:
    """None holds before those that arrived before it."""
    ordered, not_before_ns = [], 0
    for event in events:
        not_before_ns = max(not_before_ns, event.stamp_ns)
        ordered.append(event._replace(stamp_ns=not_before_ns))
    return tuple(ordered)


def _of(epoch: int, events: tuple[EventT, ...], of: npt.NDArray[np.int64]) -> tuple[EventT, ...]:
    return in_order([event for event, its in zip(events, of.tolist(), strict=True) if its == epoch])


class _Where:
    """Which epoch each position is of, and what was known of epochs when something arrived beside the positions."""

    def __init__(self, stamps_ns: Stamps, pieces: list[Piece]) -> None:
        self.stamps_ns = stamps_ns.copy()
        self._epoch = np.zeros(len(stamps_ns), dtype=np.int64)
        # Of the first i positions to arrive: epoch and newest stamp of those that were decided by then.
        self._known_epoch, self._known_newest = np.zeros((2, len(stamps_ns) + 1), dtype=np.int64)
        newest_ns = epoch = 0
        for piece in pieces:
            self._epoch[piece.begin : piece.end] = piece.epoch
            rows = self.stamps_ns[piece.begin : piece.end]
            if not piece.sound:
                rows[rows > 0] = STRAY_NS
                continue
            if piece.epoch != epoch:
                newest_ns, epoch = 0, piece.epoch
            newest = np.maximum.accumulate(np.concatenate([[newest_ns], rows]))[1:]
            newest_ns = int(newest[-1])
            known = max(piece.known_at, piece.begin + 1)
            self._known_epoch[known:] = epoch
            late = newest[known - piece.begin - 1 :] if known <= piece.end else newest[-1:]
            self._known_newest[known : known + len(late)] = late
            self._known_newest[known + len(late) :] = newest_ns
        count = int(self._epoch.max(initial=0)) + 1
        self._begins = np.searchsorted(self._epoch, np.arange(count + 1)).tolist()

    def holding(self, events: tuple[EventT, ...], arrived: npt.NDArray[np.int64]) -> tuple[EventT, ...]:
        """The events, from when on they hold."""
        newest = self._known_newest[arrived].tolist()
        return tuple(
            one._replace(stamp_ns=holds_from_ns(one.stamp_ns, newest_ns)) for one, newest_ns in zip(events, newest, strict=True)
        )

    def counting(self, stamps_ns: Stamps, arrived: Stamps) -> Stamps:
        """As counts_from_ns for each command."""
        newest = self._known_newest[arrived]
        apart = (stamps_ns <= 0) | (np.abs(stamps_ns - newest) > EVENT_AHEAD_NS)
        return np.where((newest > 0) & apart, newest, stamps_ns)

    def rows(self, epoch: int) -> slice:
        return slice(self._begins[epoch], self._begins[epoch + 1])

    def epochs(self, stamps_ns: Stamps, arrived: npt.NDArray[np.int64] | None) -> npt.NDArray[np.int64]:
        """Of each stamp, given how many positions had arrived before it."""
        if not len(stamps_ns) or not len(self._epoch):
            return np.zeros(len(stamps_ns), dtype=np.int64)
        if arrived is None:
            return self._by_order(stamps_ns)
        newest = self._known_newest[arrived]
        return self._known_epoch[arrived] + ((stamps_ns > 0) & (stamps_ns < newest - STEP_NS))

    def _by_order(self, stamps_ns: Stamps) -> npt.NDArray[np.int64]:
        """Where the order of arrival is unknown: the n-th step back of this clock is the n-th one of the positions'."""
        timeline = Timeline()
        found = np.zeros(len(stamps_ns), dtype=np.int64)
        for piece in timeline.take(stamps_ns) + timeline.finish():
            found[piece.begin : piece.end] = piece.epoch
        return np.minimum(found, len(self._begins) - 2)

    def notes(self) -> tuple[str, ...]:
        first_ns = int(self.stamps_ns[self.stamps_ns > 0][0]) if (self.stamps_ns > 0).any() else 0
        notes = []
        for begin in self._begins[1:-1]:
            before = self.stamps_ns[self.rows(int(self._epoch[begin]) - 1)]
            before_ns, after_ns = int(before.max()), int(self.stamps_ns[begin:][self.stamps_ns[begin:] > 0][0])
            notes.append(
                f'the clock goes back {(before_ns - after_ns) / NS:.1f} s at {(before_ns - first_ns) / NS:.1f} s: '
                'what comes after is taken as a recording of its own'
            )
        return tuple(notes)
