"""Samples as they come in -> demonstrations as flights end. Knows no clock: stamps and steady times are passed in."""

from __future__ import annotations

import math
from collections import deque
from enum import Enum
from typing import NamedTuple

import numpy as np

from advise_ros.core.demonstration import Demonstration, EndReason
from advise_ros.core.discretise import DiscretiseSettings, discretise
from advise_ros.core.flights import flown_altitude_m, landed_altitude_m, name, number_of, why_not
from advise_ros.core.grid import Grid
from advise_ros.core.remarks import BEGINNING_UNHEARD, beginning_unheard, taken_back
from advise_ros.core.samples import CommandSamples, PoseSamples, Recording, VehicleEvent
from advise_ros.core.tracker import CellTracker

# Samples stamped before the end of a window may still be on their way for this long (steady time).
SETTLE_S = 0.2
# Samples kept while nothing is recorded: some of a window's first ones may arrive before it opens.
KEEP = 400
# A pose this much older than the newest one means that the clock was set back.
CLOCK_BACK_NS = 1_000_000_000

Vector = tuple[float, float, float]


class Phase(Enum):
    """What the recorder is doing."""

    IDLE = 'waiting'
    OPEN = 'recording'
    CLOSING = 'finishing'


class Reply(NamedTuple):
    """Answer to start, stop or discard."""

    success: bool
    message: str


class Output(NamedTuple):
    """Something to publish, or something to tell a person, or both."""

    demonstration: Demonstration | None
    remark: str


class Recorder:
    """Collects one vehicle's samples and cuts demonstrations out of them.

    By flights: a window opens when the vehicle reaches the grid's altitude after take-off and ends at the
    final waypoint, landing or disarming; a new one needs a new take-off. The vehicle's state tells when it is
    in the air, or its altitude where the state is not known. Otherwise, and beside it, `start` and `stop`.
    Flights of a policy are left out. One whose climb was not heard, because the recorder was started in
    mid-flight or its positions came late, is kept, with a note in its audit.

    What `take` returns equals `discretise` of the samples given, within the demonstration's window, but for that note.

    Raises:
        InputError: the hysteresis is not below half a cell.
    """

    def __init__(self, grid: Grid, settings: DiscretiseSettings, source: str, *, by_flights: bool) -> None:
        self._grid, self._settings, self._source, self._by_flights = grid, settings, source, by_flights
        self._tracker = self._new_tracker()
        self._up_m = flown_altitude_m(grid, settings.altitude_tolerance_m)
        self.phase = Phase.IDLE
        self.published: list[str] = []
        self._count = 0
        self._poses: list[tuple[int, Vector]] = []
        self._commands: list[tuple[int, Vector]] = []
        self._newest_ns = self._newest_command_ns = 0
        self._pending: deque[VehicleEvent] = deque()
        self._seen_ns, self._silent_s = -1, 0.0
        self._knows_state = self._airborne = self._flown = self._policy_flies = False
        self._manual = self._was_low = self._unheard = False
        self._start_ns = self._end_ns = 0
        self._end_reason = EndReason.STOPPED
        self._closing_s: float | None = None
        self._outputs: list[Output] = []

    # -- samples -------------------------------------------------------------------------------
    def pose(self, stamp_ns: int, position_enu_m: Vector) -> None:
        """A position in the map frame; anything is taken, the audit tells what could not be used."""
        if 0 < stamp_ns < self._newest_ns - CLOCK_BACK_NS:
            self._forget()
        self._poses.append((stamp_ns, position_enu_m))
        self._trim(self._poses)
        if stamp_ns <= self._newest_ns:
            return
        self._newest_ns = stamp_ns
        self._apply_events(stamp_ns)
        if math.isfinite(position_enu_m[2]):
            self._watch_altitude(stamp_ns, position_enu_m[2])
        if self.phase is Phase.OPEN:
            self._follow(stamp_ns, position_enu_m)

    def command(self, stamp_ns: int, velocity_enu_m_s: Vector) -> None:
        """A commanded velocity in the map frame."""
        self._newest_command_ns = max(self._newest_command_ns, stamp_ns)
        self._commands.append((stamp_ns, velocity_enu_m_s))
        self._trim(self._commands)

    def vehicle(self, event: VehicleEvent) -> None:
        """The vehicle's state, as often as it is told; it holds for the positions stamped after it."""
        self._pending.append(event)
        if event.stamp_ns <= self._newest_ns:
            self._apply_events(self._newest_ns)

    def _apply_events(self, until_ns: int) -> None:
        while self._pending and self._pending[0].stamp_ns <= until_ns:
            self._apply(self._pending.popleft())

    def _apply(self, event: VehicleEvent) -> None:
        self._knows_state = True
        airborne = event.armed and event.in_air
        if self._airborne and not airborne:
            self._landed(event.stamp_ns, EndReason.LANDED if event.armed else EndReason.DISARMED)
        self._airborne = airborne

    def policy(self, *, flies: bool) -> None:
        """Whether a policy flies the vehicle."""
        self._policy_flies = flies
        if flies and self._by_flights:
            self._flown = self._flown or self._airborne
            if self.phase is Phase.OPEN and not self._manual:
                self._close(EndReason.STOPPED, self._newest_ns)

    def heard(self, demonstration_id: str) -> None:
        """Somebody holds a demonstration with this id: numbers go on after it, as after those of a former run."""
        self._count = max(self._count, number_of(demonstration_id))

    # -- what people ask -----------------------------------------------------------------------
    def start(self) -> Reply:
        """Open a window by hand; it takes the samples that are newer than all up to now."""
        if self.phase is not Phase.IDLE:
            return Reply(False, f'{self.next_id} is being recorded already; call stop or discard first')
        self._open(self._newest_ns + 1, manual=True)
        return Reply(True, f'recording {self.next_id}; it ends at the final waypoint or by stop')

    def stop(self) -> Reply:
        """End the window; its demonstration follows when late samples have had their time."""
        if self.phase is Phase.IDLE:
            last = f'; {self.published[-1]} was published' if self.published else '; call start first'
            return Reply(False, f'nothing is being recorded{last}')
        if self.phase is Phase.OPEN:
            self._manual = True
            self._close(EndReason.STOPPED, self._newest_ns)
        found = self._discretised()
        reason = why_not(found, manual=self._manual)
        if reason:
            self._idle()
            return Reply(False, f'nothing is published: {reason}')
        return Reply(True, f'{found.demonstration_id} with {len(found.states)} moves follows on topic demonstration')

    def discard(self) -> Reply:
        """Drop what is being recorded, or else take back the last demonstration published."""
        if self.phase is not Phase.IDLE:
            self._idle()
            return Reply(True, f'{self.next_id} is dropped; nothing was published')
        if not self.published:
            return Reply(False, 'nothing is being recorded and nothing was published')
        taken = self.published.pop()
        self._outputs.append(Output(taken_back(taken, self._source, self._grid, self._newest_ns), f'{taken} is taken back'))
        return Reply(True, f'{taken} is taken back: a demonstration with its id and without moves is published')

    @property
    def next_id(self) -> str:
        """Id of the demonstration being recorded, or of the next."""
        return name(self._count + 1)

    # -- results -------------------------------------------------------------------------------
    def take(self, steady_s: float) -> list[Output]:
        """What has become ready; call it now and then with the monotonic time."""
        self._settle_events(steady_s)
        if self.phase is Phase.CLOSING:
            self._closing_s = steady_s if self._closing_s is None else self._closing_s
            later = min(self._newest_ns, self._newest_command_ns) > self._end_ns
            if later or steady_s - self._closing_s >= SETTLE_S:
                self._finish()
        ready, self._outputs = self._outputs, []
        return ready

    def _settle_events(self, steady_s: float) -> None:
        """Events ahead of the positions count all the same when no positions come for a while."""
        if not self._pending or self._newest_ns != self._seen_ns:
            self._seen_ns, self._silent_s = self._newest_ns, steady_s
        elif steady_s - self._silent_s >= SETTLE_S:
            self._apply_events(max(event.stamp_ns for event in self._pending))

    def _finish(self) -> None:
        found = self._discretised()
        reason = why_not(found, manual=self._manual)
        self._idle()
        if reason:
            self._outputs.append(Output(None, f'the flight gives no demonstration: {reason}'))
            return
        self._count += 1
        self.published.append(found.demonstration_id)
        ended = found.end_reason.name.lower().replace('_', ' ')
        remark = f'{found.demonstration_id}: {len(found.states)} moves, ended by {ended}'
        self._outputs.append(Output(found, f'{remark}; {BEGINNING_UNHEARD}' if self._unheard else remark))

    def _discretised(self) -> Demonstration:
        recording = Recording(
            PoseSamples(*_arrays(self._poses)), CommandSamples(*_arrays(self._commands)), source=self._source,
        )
        window_ns = (self._start_ns, self._end_ns)
        found = discretise(self._grid, recording, window_ns, self._settings, self.next_id, self._end_reason)
        return beginning_unheard(found) if self._unheard else found

    def adopt(self, demonstrations: tuple[Demonstration, ...]) -> None:
        """Publish demonstrations made elsewhere, as if they had been recorded."""
        for found in demonstrations:
            self._outputs.append(Output(found, f'{found.demonstration_id}: {len(found.states)} moves'))
            self.published.append(found.demonstration_id)
        self._count += len(demonstrations)

    # -- windows -------------------------------------------------------------------------------
    def _new_tracker(self) -> CellTracker:
        settings = self._settings
        return CellTracker(
            self._grid, settings.hysteresis_m, max_skip_cells=settings.max_skip_cells, max_gap_s=settings.max_gap_s,
        )

    def _watch_altitude(self, stamp_ns: int, altitude_m: float) -> None:
        if not self._knows_state:
            if self._airborne and altitude_m < landed_altitude_m(self._grid):
                self._landed(stamp_ns, EndReason.LANDED)
                self._airborne = False
            self._airborne = self._airborne or altitude_m >= landed_altitude_m(self._grid)
        self._was_low = self._was_low or altitude_m < self._up_m
        if self._by_flights and self._airborne and not self._flown and altitude_m >= self._up_m:
            self._flown = True
            if self.phase is Phase.IDLE and not self._policy_flies:
                self._open(stamp_ns, manual=False)

    def _landed(self, stamp_ns: int, reason: EndReason) -> None:
        self._flown = False
        if self.phase is Phase.OPEN and not self._manual:
            self._close(reason, stamp_ns if stamp_ns > self._start_ns else self._newest_ns)

    def _open(self, start_ns: int, *, manual: bool) -> None:
        self.phase, self._manual = Phase.OPEN, manual
        self._start_ns = start_ns
        self._unheard = not manual and not self._was_low
        self._tracker = self._new_tracker()

    def _follow(self, stamp_ns: int, position_enu_m: Vector) -> None:
        """As discretise does with samples that are newer than all before."""
        x_enu_m, y_enu_m, z_enu_m = position_enu_m
        if abs(z_enu_m - self._grid.altitude_m) <= self._settings.altitude_tolerance_m:
            self._tracker.update(x_enu_m, y_enu_m, stamp_ns)
        if self._tracker.finished:
            self._close(EndReason.FINAL_WAYPOINT, stamp_ns)

    def _close(self, reason: EndReason, end_ns: int) -> None:
        self.phase, self._end_reason, self._end_ns, self._closing_s = Phase.CLOSING, reason, end_ns, None

    def _idle(self) -> None:
        self.phase = Phase.IDLE
        del self._poses[:-KEEP], self._commands[:-KEEP]

    def _trim(self, samples: list[tuple[int, Vector]]) -> None:
        if self.phase is Phase.IDLE and len(samples) > 2 * KEEP:
            del samples[:-KEEP]

    def _forget(self) -> None:
        """The clock was set back: old samples would lie in the way of new ones."""
        if self.phase is not Phase.IDLE:
            remark = 'the clock of the positions was set back: what was being recorded is dropped'
            self._outputs.append(Output(None, remark))
        self._poses.clear()
        self._commands.clear()
        self._newest_ns = self._newest_command_ns = 0
        self._pending.clear()
        self._idle()


def _arrays(rows: list[tuple[int, Vector]]) -> tuple[np.ndarray, np.ndarray]:
    stamps_ns = np.array([stamp_ns for stamp_ns, _ in rows], dtype=np.int64)
    return stamps_ns, np.array([vector for _, vector in rows], dtype=np.float64).reshape(-1, 3)
