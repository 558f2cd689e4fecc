"""Samples as they come in -> demonstrations as flights end. Knows no clock: stamps and steady times are passed in."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np

from advise_ros.core.demonstrations.action_rule import ActionVerdict
from advise_ros.core.demonstrations.demonstration import CLIMB_MISSED, Demonstration, EndReason, taken_back
from advise_ros.core.demonstrations.discretise import DiscretiseSettings, fitness, follow, new_tracker
from advise_ros.core.demonstrations.flight_windows import Bands, Flight, Segmenter
from advise_ros.core.demonstrations.live_samples import LiveSamples, Sample, arrays
from advise_ros.core.demonstrations.recorded_flights import demonstration_of, name, number_of, why_not
from advise_ros.core.demonstrations.samples import NEVER_NS, PolicyEvent, PoseSamples, VehicleEvent
from advise_ros.core.grid.cell_path import Follower
from advise_ros.core.grid.grid import Action, Grid
from advise_ros.core.units import NS, Vector

# Samples of one stamp may be on their way for this long, and overtake each other.
SETTLE_S = 0.2
SETTLE_NS = round(SETTLE_S * NS)
# After this long without a position, those that are held back as doubtful are given up.
SILENCE_S = 5.0


class RecorderPhase(Enum):
    """What the recorder is doing."""

    IDLE = 'waiting'
    OPEN = 'recording'
    CLOSING = 'finishing'


class RecorderReply(NamedTuple):
    """Answer to start, stop or discard."""

    success: bool
    message: str


class Output(NamedTuple):
    """A demonstration to publish, or a remark for a person, or both; `warning`: the person should look."""

    demonstration: Demonstration | None
    remark: str
    warning: bool = False


class Recorder:
    """Collects one vehicle's samples and cuts demonstrations out of them.

    By flights: a window opens when the vehicle reaches the grid's altitude after take-off and ends at the
    final waypoint, landing or disarming; a new one needs a new take-off (see Segmenter). Otherwise, and beside it,
    `start` and `stop`. Flights of a policy are left out unless `policy_flights`. One whose climb was not received, because the
    recorder was started in mid-flight or its positions came late, is kept, with a note in its audit. Where the vehicle
    goes elsewhere than commanded, there is a warning at once.

    What `take` returns equals demonstrations_of the samples given (core/demonstrations/recorded_flights.py), as long as none is
    later than SETTLE_S; and each equals `discretise` of its own window, but for the note on its climb.

    Raises:
        InputError: the hysteresis is not below half a cell.
    """

    def __init__(
        self, grid: Grid, settings: DiscretiseSettings, source: str, *, by_flights: bool, policy_flights: bool = False,
    ) -> None:
        self._grid, self._settings, self._source, self._by_flights = grid, settings, source, by_flights
        self._samples = LiveSamples()
        self._bands = Bands(grid, settings.altitude_tolerance_m)
        self._segmenter = Segmenter(policy_flights=policy_flights)
        self._follower = Follower(new_tracker(grid, settings))
        self._followed = self._moves = self._newest_ns = 0
        self.phase = RecorderPhase.IDLE
        self.published: list[str] = []
        self._count = 0
        self._manual = False
        self._start_ns = self._end_ns = 0
        self._seen = self._arrived = 0
        self._silent_since_s = 0.0
        self._closing_s: float | None = None
        self._outputs: list[Output] = []

    # -- samples -------------------------------------------------------------------------------
    def pose(self, stamp_ns: int, position_enu_m: Vector) -> None:
        """A position in the map frame; anything is taken, the audit counts what could not be used.

        Args:
            stamp_ns: of its header.
            position_enu_m: (east, north, up).
        """
        self._arrived += 1
        for is_new_epoch, samples in self._samples.pose(stamp_ns, position_enu_m):
            if is_new_epoch:
                self._new_epoch()
            self._samples.add(samples)
            if len(samples) == 1 and self._bands.is_same(samples[0][0], samples[0][1][2]):
                continue
            stamps_ns = np.array([stamp for stamp, _ in samples], dtype=np.int64)
            for event in self._bands.take(stamps_ns, np.array([position[2] for _, position in samples])):
                self._samples.happens(event)
        if self.phase is RecorderPhase.IDLE:
            self._samples.trim()

    def command(self, stamp_ns: int, velocity_enu_m_s: Vector) -> None:
        """A commanded velocity in the map frame.

        Args:
            stamp_ns: of its header.
            velocity_enu_m_s: (east, north, up).
        """
        self._samples.command(stamp_ns, velocity_enu_m_s)

    def vehicle(self, event: VehicleEvent) -> None:
        """The vehicle's state, as often as it comes; it holds for the positions stamped after it."""
        self._samples.event(event)

    def policy(self, *, flies: bool, stamp_ns: int = 0) -> None:
        """Whether a policy flies the vehicle.

        Args:
            flies: true from now on.
            stamp_ns: since when; 0: since the newest position.
        """
        self._samples.event(PolicyEvent(stamp_ns, flies))

    def skip_number(self, demonstration_id: str) -> None:
        """Number the next demonstrations after this id, which another run has published."""
        self._count = max(self._count, number_of(demonstration_id))

    # -- what people ask -----------------------------------------------------------------------
    def start(self) -> RecorderReply:
        """Open a window by hand; it takes the samples that are newer than all up to now."""
        if self.phase is not RecorderPhase.IDLE:
            return RecorderReply(False, f'{self.next_id} is being recorded already; call stop or discard first')
        self._open(self._samples.newest_ns + 1, manual=True)
        return RecorderReply(True, f'recording {self.next_id}; it ends at the final waypoint or by stop')

    def stop(self) -> RecorderReply:
        """End the window; its demonstration follows when late samples have had their time."""
        if self.phase is RecorderPhase.IDLE:
            last = f'; {self.published[-1]} was published' if self.published else '; call start first'
            return RecorderReply(False, f'nothing is being recorded{last}')
        if self.phase is RecorderPhase.OPEN:
            self._manual = True
            self._close()
        flight = self._stopped()
        found = self._demonstration(flight)
        reason = why_not(found, flight, manual=True)
        if reason:
            self._idle()
            return RecorderReply(False, f'nothing is published: {reason}')
        return RecorderReply(True, f'{found.demonstration_id} with {len(found.states)} moves follows on topic demonstration')

    def discard(self) -> RecorderReply:
        """Drop what is being recorded, or else take back the last demonstration published."""
        if self.phase is not RecorderPhase.IDLE:
            self._idle()
            return RecorderReply(True, f'{self.next_id} is dropped; nothing was published')
        if not self.published:
            return RecorderReply(False, 'nothing is being recorded and nothing was published')
        return self.take_back(self.published[-1])

    def take_back(self, demonstration_id: str) -> RecorderReply:
        """Take back a demonstration that was published.

        Args:
            demonstration_id: of the demonstration.
        """
        if demonstration_id not in self.published:
            ours = ', '.join(self.published) or 'none yet'
            return RecorderReply(False, f"'{demonstration_id}' was not published by this recorder; published: {ours}")
        self.published.remove(demonstration_id)
        back = taken_back(demonstration_id, self._source, self._grid, self._samples.newest_ns)
        self._outputs.append(Output(back, f'{demonstration_id} is taken back'))
        return RecorderReply(
            True, f'{demonstration_id} is taken back: a demonstration with its id and without moves is published',
        )

    @property
    def next_id(self) -> str:
        """Id of the demonstration being recorded, or of the next."""
        return name(self._count + 1)

    # -- results -------------------------------------------------------------------------------
    def take(self, steady_s: float) -> list[Output]:
        """What has become ready; call it a few times a second.

        Args:
            steady_s: monotonic time.
        """
        self._apply(self._settled_ns(steady_s))
        if self.phase is RecorderPhase.CLOSING:
            self._closing_s = steady_s if self._closing_s is None else self._closing_s
            later = min(self._samples.newest_ns, self._samples.newest_command_ns) > self._end_ns
            if later or steady_s - self._closing_s >= SETTLE_S:
                self._finish(self._stopped())
        ready, self._outputs = self._outputs, []
        return ready

    def adopt(self, demonstrations: tuple[Demonstration, ...]) -> None:
        """Publish demonstrations made elsewhere, as if they had been recorded."""
        for found in demonstrations:
            self._outputs.append(Output(found, f'{found.demonstration_id}: {len(found.states)} moves'))
            self.published.append(found.demonstration_id)
        self._count += len(demonstrations)

    # -- in the order of the stamps ------------------------------------------------------------
    def _settled_ns(self, steady_s: float) -> int:
        """Nothing is on its way any more with a stamp up to this one."""
        if self._arrived != self._seen:
            self._seen, self._silent_since_s = self._arrived, steady_s
        silent_s = steady_s - self._silent_since_s
        if silent_s >= (SILENCE_S if self._samples.waits_for_more else SETTLE_S):
            return NEVER_NS
        return self._samples.newest_ns - SETTLE_NS

    def _apply(self, until_ns: int) -> None:
        pending = self._samples.pending
        while pending and pending[0].stamp_ns <= until_ns:
            event = pending.pop(0)
            self._follow(event.stamp_ns)
            opened_ns = self._segmenter.opened_ns
            self._ended(self._segmenter.take(event))
            if self._segmenter.opened_ns not in (opened_ns, -1) and self._by_flights and self.phase is RecorderPhase.IDLE:
                self._open(self._segmenter.opened_ns, manual=False)
        self._follow(until_ns)

    def _ended(self, flight: Flight | None) -> None:
        if flight is not None and self.phase is RecorderPhase.OPEN and not self._manual:
            self._finish(flight)

    def _new_epoch(self) -> None:
        """The clock was set back: what is sound before that is a flight up to there."""
        self._apply(NEVER_NS)
        self._ended(self._segmenter.new_epoch(self._samples.newest_ns))
        if self.phase is not RecorderPhase.IDLE:
            self._close()
            self._finish(self._stopped())
        self._outputs.append(Output(None, 'the clock of the positions was set back; a flight under way ends there', warning=True))
        self._samples.new_epoch()
        self._bands.restart()

    # -- windows -------------------------------------------------------------------------------
    def _open(self, start_ns: int, *, manual: bool) -> None:
        self.phase, self._manual, self._start_ns = RecorderPhase.OPEN, manual, start_ns
        self._follower = Follower(new_tracker(self._grid, self._settings))
        self._followed, self._moves, self._newest_ns = 0, 0, start_ns - 1

    def _follow(self, until_ns: int) -> None:
        """Go along the positions up to a stamp; at each move look at the flight as discretise does."""
        if self.phase is not RecorderPhase.OPEN:
            return
        fresh: list[Sample] = []
        poses = self._samples.poses
        while self._followed < len(poses) and poses[self._followed][0] <= until_ns:
            if poses[self._followed][0] > self._newest_ns:
                self._newest_ns = poses[self._followed][0]
                fresh.append(poses[self._followed])
            self._followed += 1
        if not fresh:
            return
        samples = PoseSamples(*arrays(fresh))
        on_grid = fitness(self._grid, samples, self._settings).on_grid
        self._follower.take(samples.stamps_ns[on_grid], samples.positions_enu_m[on_grid])
        if len(self._follower.track.states) > self._moves or self._follower.end_ns is not None:
            self._look()

    def _look(self) -> None:
        """Say at once where the vehicle went elsewhere than commanded; end at the final waypoint."""
        recording = self._samples.recording(self._source)
        followed = follow(self._grid, recording, (self._start_ns, self._newest_ns), self._settings)
        if followed is None:
            return
        track, begin = followed.follower.track, self._moves
        for state, motion, decided in list(zip(track.states, track.motions, followed.decided, strict=True))[begin:]:
            if decided.verdict is ActionVerdict.ASTRAY:
                cell = list(self._grid.xy(self._grid.cell_of(state)))
                went = f'{self.next_id}: it went {Action(motion).name} from cell {cell}'
                remark = f'{went} while {Action(decided.action).name} was commanded; the command is taken as the action'
                self._outputs.append(Output(None, remark, warning=True))
        self._moves = len(track.states)
        if followed.ended:
            end_ns = followed.window_ns[1]
            flight = Flight((self._start_ns, end_ns), EndReason.FINAL_WAYPOINT)
            self._finish(flight if self._manual else self._segmenter.so_far(flight))

    def _close(self) -> None:
        """The window ends here; late samples have their time still."""
        self.phase, self._end_ns, self._closing_s = RecorderPhase.CLOSING, self._samples.newest_ns, None

    def _stopped(self) -> Flight:
        flight = Flight((self._start_ns, self._end_ns), EndReason.STOPPED)
        return self._segmenter.so_far(flight) if self._segmenter.opened_ns == self._start_ns else flight

    def _demonstration(self, flight: Flight) -> Demonstration:
        return demonstration_of(self._grid, self._samples.recording(self._source), flight, self._settings, self.next_id)

    def _finish(self, flight: Flight) -> None:
        found = self._demonstration(flight)
        reason = why_not(found, flight, manual=self._manual)
        self._idle()
        if reason:
            self._outputs.append(Output(None, f'the flight gives no demonstration: {reason}'))
            return
        self._count += 1
        self.published.append(found.demonstration_id)
        ended = found.end_reason.name.lower().replace('_', ' ')
        remark = f'{found.demonstration_id}: {len(found.states)} moves, ended by {ended}'
        self._outputs.append(Output(found, f'{remark}; {CLIMB_MISSED}' if flight.climb_missed else remark))

    def _idle(self) -> None:
        self.phase = RecorderPhase.IDLE
        self._samples.trim()
