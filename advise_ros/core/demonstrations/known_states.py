"""What the vehicle's state says is true for a while: one that is not repeated is not known any more."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.samples import PolicyEvent, VehicleEvent
from advise_ros.core.units import NS

Stamps = npt.NDArray[np.int64]

# An autopilot sends its state once a second at least; ground stations call it lost after this long.
SILENCE_NS = 5 * NS

EventT = TypeVar('EventT', VehicleEvent, PolicyEvent)


def unknown(stamp_ns: int) -> VehicleEvent:
    """From a stamp on the state is not known: the altitude says whether the vehicle is in the air."""
    return VehicleEvent(stamp_ns, armed=True, in_air=None)


def with_silences(
    events: Sequence[VehicleEvent], arrived: Sequence[int], poses_ns: Stamps,
) -> tuple[list[VehicleEvent], list[int]]:
    """The events, with one more wherever the next does not come and positions go on.

    Args:
        events: of a source that repeats them all the time, each message, in order of arrival.
        arrived: how many positions had arrived before each.
        poses_ns: (n,) stamps of the positions.
    """
    all_events: list[VehicleEvent] = []
    all_arrived: list[int] = []
    for index, (event, begin) in enumerate(zip(events, arrived, strict=True)):
        all_events.append(event)
        all_arrived.append(begin)
        end = arrived[index + 1] if index + 1 < len(arrived) else len(poses_ns)
        if end - begin < 2:
            continue
        late = np.flatnonzero(poses_ns[begin:end] > poses_ns[begin] + SILENCE_NS)
        if late.size:
            row = begin + int(late[0])
            all_events.append(unknown(int(poses_ns[row])))
            all_arrived.append(row)
    return all_events, all_arrived


def changes(events: Sequence[EventT], arrived: Sequence[int]) -> tuple[tuple[EventT, ...], Stamps]:
    """Each event that differs from the one before it.

    Args:
        events: of one kind, in order of arrival.
        arrived: how many positions had arrived before each.

    Returns:
        The events that are kept, and how many positions had arrived before each of them (m,).
    """
    kept = [row for row, event in enumerate(events) if not row or event[1:] != events[row - 1][1:]]
    return tuple(events[row] for row in kept), np.array([arrived[row] for row in kept], dtype=np.int64)
