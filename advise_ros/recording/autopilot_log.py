"""What the logs of autopilots have in common."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.samples import VehicleEvent

NS_PER_US = 1000
NO_PLACE = 'it holds no place on the earth, so its own origin was taken for that of the grid and origin_wgs84 was not used'

Integers = npt.NDArray[np.int64]
# Stamp, place in the log, and what changed.
Change = tuple[int, int, Mapping[str, Any]]


def events_of(changes: Iterable[Change], begin: VehicleEvent) -> tuple[tuple[VehicleEvent, ...], Integers]:
    """The states that changes make one after the other, in the order of their places, and these places.

    Args:
        changes: of the vehicle's state.
        begin: the state before them.
    """
    state = begin
    events: list[VehicleEvent] = []
    places: list[int] = []
    for stamp_ns, place, changed in sorted(changes, key=lambda change: change[1]):
        state = state._replace(**changed)
        if not events or events[-1][1:] != state[1:]:
            events.append(state._replace(stamp_ns=stamp_ns))
            places.append(place)
    return tuple(events), np.array(places, dtype=np.int64)
