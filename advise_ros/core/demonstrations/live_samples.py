"""What a recorder holds of the samples that come in: those of the present clock, in order of arrival."""

from __future__ import annotations

from bisect import insort

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.epochs import counts_from_ns, holds_from_ns, place
from advise_ros.core.demonstrations.flight_windows import KINDS, Event, order
from advise_ros.core.demonstrations.samples import (
    NEVER_NS,
    STRAY_NS,
    CommandSamples,
    PolicyEvent,
    PoseSamples,
    Recording,
    VehicleEvent,
)
from advise_ros.core.demonstrations.timeline import Timeline
from advise_ros.core.units import Vector

# Samples kept while nothing is recorded: some of a window's first ones may arrive before it opens.
KEEP = 400

Sample = tuple[int, Vector]


class LiveSamples:
    """Samples since the positions' clock was last set back, as core/demonstrations/epochs.py divides a whole recording.

    Attributes:
        newest_ns: newest stamp of a position, 0 before the first.
        poses, commands: in order of arrival.
        pending: what has happened and is not applied yet, in the order of its stamps.
        waits_for_more: the last positions are far from the others, and it is not known yet what they mean.
    """

    def __init__(self) -> None:
        self._timeline = Timeline()
        self._waiting: list[Sample] = []
        self._released = 0
        self.newest_ns = self.newest_command_ns = 0
        self.poses: list[Sample] = []
        self.commands: list[Sample] = []
        self.states: list[VehicleEvent] = []
        self.pending: list[Event] = []
        self.commanded_ns = NEVER_NS
        self._event_ns = dict.fromkeys(KINDS, 0)
        self._next_commands: list[Sample] = []
        self._next_events: list[VehicleEvent | PolicyEvent] = []

    @property
    def waits_for_more(self) -> bool:
        return self._timeline.holds

    def pose(self, stamp_ns: int, position_enu_m: Vector) -> list[tuple[bool, list[Sample]]]:
        """Take a position.

        The caller adds them by `add`, after `new_epoch` where that is so.

        Args:
            stamp_ns: of its header.
            position_enu_m: (east, north, up).

        Returns:
            The samples that are decided by it, in runs, each with whether it begins another epoch.
        """
        self._waiting.append((stamp_ns, position_enu_m))
        before, found = self._timeline.epoch, []
        for piece in self._timeline.take_one(stamp_ns):
            count = piece.end - self._released
            samples, self._waiting, self._released = self._waiting[:count], self._waiting[count:], piece.end
            if not piece.sound:
                samples = [(STRAY_NS if stamp > 0 else stamp, position) for stamp, position in samples]
            found.append((piece.epoch != before, samples))
            before = piece.epoch
        return found

    def add(self, samples: list[Sample]) -> None:
        """Positions of the present epoch."""
        self.poses += samples
        self.newest_ns = max(self.newest_ns, *(stamp_ns for stamp_ns, _ in samples))

    def command(self, stamp_ns: int, velocity_enu_m_s: Vector) -> None:
        """A commanded velocity.

        Args:
            stamp_ns: of its header, 0 where it has none.
            velocity_enu_m_s: (east, north, up).
        """
        stamp_ns = counts_from_ns(stamp_ns, self.newest_ns)
        if place(stamp_ns, self.newest_ns):
            self._next_commands.append((stamp_ns, velocity_enu_m_s))
            return
        self.commands.append((stamp_ns, velocity_enu_m_s))
        self.newest_command_ns = max(self.newest_command_ns, stamp_ns)
        if stamp_ns > 0:
            self.commanded_ns = min(self.commanded_ns, stamp_ns)

    def event(self, event: VehicleEvent | PolicyEvent) -> None:
        """The vehicle's state or a policy's."""
        event = event._replace(stamp_ns=holds_from_ns(event.stamp_ns, self.newest_ns))
        if place(event.stamp_ns, self.newest_ns):
            self._next_events.append(event)
            return
        self._event_ns[type(event)] = max(event.stamp_ns, self._event_ns[type(event)])  # As epochs.in_order.
        event = event._replace(stamp_ns=self._event_ns[type(event)])
        self.happens(event)
        if isinstance(event, VehicleEvent) and (not self.states or self.states[-1][1:] != event[1:]):
            self.states.append(event)

    def happens(self, event: Event) -> None:
        """Put it where its stamp belongs among what is pending."""
        insort(self.pending, event, key=order)

    def new_epoch(self) -> None:
        """The clock was set back: what is here was of the old one, but for what came early."""
        self.poses, self.commands, self.newest_ns, self.newest_command_ns = [], [], 0, 0
        if self.commanded_ns != NEVER_NS:
            self.commanded_ns = 0
        self.states, self.pending, self._event_ns = [], [], dict.fromkeys(KINDS, 0)
        commands, events, self._next_commands, self._next_events = self._next_commands, self._next_events, [], []
        for sample in commands:
            self.command(*sample)
        for event in events:
            self.event(event)

    def trim(self) -> None:
        """Forget what is too old to belong to a flight that begins."""
        for samples in (self.poses, self.commands):
            if len(samples) > 2 * KEEP:
                del samples[:-KEEP]

    def recording(self, source: str) -> Recording:
        """All that is here."""
        poses, commands = PoseSamples(*arrays(self.poses)), CommandSamples(*arrays(self.commands))
        return Recording(poses, commands, tuple(self.states), source=source, commanded_ns=self.commanded_ns)


def arrays(rows: list[Sample]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Stamps (n,) and vectors (n, 3)."""
    stamps_ns = np.array([stamp_ns for stamp_ns, _ in rows], dtype=np.int64)
    return stamps_ns, np.array([vector for _, vector in rows], dtype=np.float64).reshape(-1, 3)
