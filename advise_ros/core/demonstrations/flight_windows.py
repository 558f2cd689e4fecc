"""When flights along the route begin and end: a fold over what happens, in the order of its stamps."""

from __future__ import annotations

import math
from bisect import bisect_right
from enum import IntEnum
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.demonstration import EndReason
from advise_ros.core.demonstrations.samples import PolicyEvent, VehicleEvent
from advise_ros.core.grid.grid import Grid

# Shares of the grid's altitude: above the first a climb may be over, below the second a flight is.
UP_SHARE, DOWN_SHARE = 0.75, 0.5


class Band(IntEnum):
    """How high a position is."""

    GROUND = 0
    CLIMB = 1
    ROUTE = 2


class BandEvent(NamedTuple):
    """From a stamp on the positions are in another band."""

    stamp_ns: int
    band: Band


Event = VehicleEvent | PolicyEvent | BandEvent
KINDS = (VehicleEvent, PolicyEvent, BandEvent)


class Flight(NamedTuple):
    """A window of stamps, both ends included, and why it ended.

    Attributes:
        window_ns: from the first position at the altitude of the route; a flight that is not over ends at LATEST_NS.
        end_reason: STOPPED means that a policy took over.
        climb_missed: the climb to the route was not received.
        lost_ns: when the link to the vehicle was lost in it, -1 if it was not.
    """

    window_ns: tuple[int, int]
    end_reason: EndReason
    climb_missed: bool = False
    lost_ns: int = -1


def order(event: Event) -> tuple[int, int]:
    """Events at one stamp: what a vehicle's state or a policy says holds for positions with the same stamp."""
    return event.stamp_ns, KINDS.index(type(event))


def flown_altitude_m(grid: Grid, altitude_tolerance_m: float) -> float:
    """The altitude above which a climbing vehicle begins its route [m].

    Args:
        grid: its altitude.
        altitude_tolerance_m: how far off that the route may be flown.
    """
    return max(grid.altitude_m - altitude_tolerance_m, UP_SHARE * grid.altitude_m)


def landed_altitude_m(grid: Grid) -> float:
    """Below this altitude a flight is over, where no vehicle state is known."""
    return DOWN_SHARE * grid.altitude_m


class Bands:
    """The changes of altitude band along positions, given in blocks of any size."""

    def __init__(self, grid: Grid, altitude_tolerance_m: float) -> None:
        self._edges = [landed_altitude_m(grid), flown_altitude_m(grid, altitude_tolerance_m)]
        self._edges_m = np.array(self._edges)
        self._band: int | None = None
        self._newest_ns = 0

    def restart(self) -> None:
        """The clock was set back."""
        self._newest_ns = 0

    def is_same(self, stamp_ns: int, altitude_m: float) -> bool:
        """Whether one position changes nothing; then it need not be taken.

        Args:
            stamp_ns: of the position.
            altitude_m: above the grid's zero.
        """
        if stamp_ns <= self._newest_ns or not math.isfinite(altitude_m):
            return True
        if self._band is None or bisect_right(self._edges, altitude_m) != self._band:
            return False
        self._newest_ns = stamp_ns
        return True

    def take(self, stamps_ns: npt.NDArray[np.int64], altitudes_m: npt.NDArray[np.float64]) -> list[BandEvent]:
        """The crossings that positions make; late or unstamped ones and those that are no numbers make none.

        Args:
            stamps_ns: (n,) in order of arrival.
            altitudes_m: (n,).
        """
        newest = np.maximum.accumulate(np.concatenate([[self._newest_ns], stamps_ns]))
        used = (stamps_ns > newest[:-1]) & np.isfinite(altitudes_m)
        self._newest_ns = int(newest[-1])
        stamps_ns, bands = stamps_ns[used], np.searchsorted(self._edges_m, altitudes_m[used], side='right')
        if not len(bands):
            return []
        changed = np.flatnonzero(np.diff(bands, prepend=-1 if self._band is None else self._band))
        self._band = int(bands[-1])
        return [BandEvent(int(stamps_ns[row]), Band(int(bands[row]))) for row in changed]


class Segmenter:
    """Takes events in the order of their stamps; a flight begins at the route's altitude after a take-off, once each.

    The vehicle's state says whether it is in the air, or its altitude as long as the state is not known. A state
    without a link (`connected` false) says nothing, and after it the vehicle is on the ground only when it is
    disarmed or low. A flight ends when the vehicle lands or disarms, or when a policy takes over; with
    `policy_flights` a policy's flights are flights like others.

    Attributes:
        opened_ns: when the flight under way began, -1 where there is none.
    """

    def __init__(self, *, policy_flights: bool = False) -> None:
        self._policy_flights = policy_flights
        self._state: VehicleEvent | None = None
        self._knows_state = self._airborne = self._flown = self._policy_flies = False
        self._was_low = self._was_lost = False
        self._band: Band | None = None
        self.opened_ns = -1
        self._lost_ns = -1
        self._climb_missed = False

    def take(self, event: Event) -> Flight | None:
        """The flight that an event ends."""
        if isinstance(event, BandEvent):
            ended = self._take_band(event)
        elif isinstance(event, PolicyEvent):
            ended = self._take_policy(event)
        else:
            ended = self._take_state(event)
        if self._airborne and not self._flown and self._band is Band.ROUTE:
            self._flown = True
            if not self._policy_flies:
                self.opened_ns, self._climb_missed, self._lost_ns = event.stamp_ns, not self._was_low, -1
        return ended

    def so_far(self, flight: Flight) -> Flight:
        """A part of the flight under way, with what is known of that."""
        return flight._replace(climb_missed=self._climb_missed, lost_ns=self._lost_ns)

    def new_epoch(self, newest_ns: int) -> Flight | None:
        """The clock was set back: the rest of a flight under way is not another flight.

        Args:
            newest_ns: newest stamp before that.
        """
        self._knows_state = False
        return self.end(newest_ns)

    def end(self, newest_ns: int) -> Flight | None:
        """The recording ends, in mid-flight perhaps.

        Args:
            newest_ns: newest stamp of it.
        """
        return self._close(newest_ns, EndReason.END_OF_LOG)

    def _take_band(self, event: BandEvent) -> Flight | None:
        self._band = event.band
        self._was_low = self._was_low or event.band is not Band.ROUTE
        if self._knows_state:
            return None
        if event.band is Band.GROUND:
            return self._landed(event.stamp_ns, EndReason.LANDED)
        self._airborne = True
        return None

    def _take_policy(self, event: PolicyEvent) -> Flight | None:
        if self._policy_flights:
            return None
        self._policy_flies = event.flies
        if not event.flies:
            return None
        self._flown = self._flown or self._airborne
        return self._close(event.stamp_ns - 1, EndReason.STOPPED)

    def _take_state(self, event: VehicleEvent) -> Flight | None:
        before, self._state = self._state, event
        if before is not None and event[1:] == before[1:]:
            return None
        if not event.connected:
            was_linked = before is not None and before.connected
            if was_linked and self.opened_ns >= 0 and self._lost_ns < 0:
                self._lost_ns = event.stamp_ns
            self._knows_state, self._was_lost = False, self._was_lost or was_linked
            return None
        high = self._band is not None and self._band is not Band.GROUND
        in_air = event.armed and (high if event.in_air is None else event.in_air)
        if event.armed and not in_air and self._was_lost and high:
            return None  # A bridge that has come back does not know yet.
        self._was_lost = False
        self._knows_state = event.in_air is not None or not event.armed
        if not in_air:
            return self._landed(event.stamp_ns, EndReason.LANDED if event.armed else EndReason.DISARMED)
        self._airborne = True
        return None

    def _landed(self, stamp_ns: int, reason: EndReason) -> Flight | None:
        if not self._airborne:
            return None
        self._airborne = self._flown = self._policy_flies = False
        return self._close(stamp_ns, reason)

    def _close(self, end_ns: int, reason: EndReason) -> Flight | None:
        if self.opened_ns < 0:
            return None
        start_ns, self.opened_ns = self.opened_ns, -1
        return Flight((start_ns, end_ns), reason, self._climb_missed, self._lost_ns)
