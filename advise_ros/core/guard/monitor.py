"""The guard over time: what arrived and when, delays, jumps, how fast the velocity grows, the stop, the way back inside."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from advise_ros.core.guard import rules
from advise_ros.core.guard.delay_watch import DelayWatch
from advise_ros.core.guard.fence import Braking, Point
from advise_ros.core.guard.flown_path import FlownPath, moved
from advise_ros.core.guard.return_inside import ReturnInside, as_good
from advise_ros.core.guard.rules import Command, GuardVerdict, Limits, Position
from advise_ros.core.guard.stamp_watch import StampWatch
from advise_ros.core.parameter import parameter
from advise_ros.core.units import NS, ZERO, Vector

# A pause in checking is no licence to accelerate.
LONGEST_STEP_S = 0.1
# No multicopter of this package is faster.
PLAUSIBLE_M_S = 20.0
# A position that jumped is believed again when it was steady for this long, positions that came late when they were in time.
SETTLED_S, IN_TIME_S = 1.0, 0.25
# A silence longer than this may hide a jump: positions after it begin another track.
HIDES_JUMP_S = 0.3
# A delay counts twice, as in `Limits.reaction_s`.
REACTIONS = 2.0
# Stamps count for as much as this; their clock may run faster than steady time (simulation).
LONGEST_STAMPED_S = 5.0
# A vehicle that stands by velocity drifts this fast; while news and commands are late, the fence is as much nearer.
DRIFT_M_S = 0.3
PAUSED = 'if the autopilot was paused: release'
SLOW = 'if that is how slow the link is: raise vehicle_delay_s'
NOT_BROUGHT = 'it is not brought back inside, as {}: fly it back, or release'
# Positions and commands that are later together than this bring nothing back inside.
LATEST_S = 25.0


@dataclass(frozen=True)
class MonitorSettings:
    """What the guard does beside checking: parameters of /guard and /mavlink_bridge.

    Attributes:
        lifts: whether a vehicle is brought up into the fence, too; only for one that is known to fly.
    """

    max_acceleration_m_s2: float = parameter(
        10.0, 'how fast a commanded velocity may grow (steady time); raise it where a simulation runs faster',
        low=0.1, high=10_000.0,
    )
    jump_m: float = parameter(
        2.0, 'a position that jumps further than this and flying explain is doubted; 0: no', low=0.0, high=1e4,
    )
    latch: bool = parameter(False, 'a doubt about pose or command stops the vehicle until its release service is called')
    vehicle_delay_s: float = parameter(
        0.2, 'delay of a position on its way here and of a command to its effect together, for the fence; of a slow link: '
        'its round trip', low=0.0, high=5.0,
    )
    return_inside: bool = parameter(
        True, 'bring a vehicle that is outside the fence back in (0.5 m/s, the shortest way), also when nobody commands; '
        'false: zero velocity',
    )
    lifts: bool = False


class GuardMonitor:
    """Takes poses and commands as they arrive, says what may be flown now. All times are steady.

    Attributes:
        latched: why the vehicle is stopped until `release`, '' if it is not.
        condition: of the last verdict: '' (the command passes), 'limited', 'silence' (no command), 'doubt',
            'return' (it is brought back inside) or 'stop'.
    """

    def __init__(self, limits: Limits, settings: MonitorSettings) -> None:
        self._given, self._settings = limits, settings
        self._uplink_s = 0.0
        self._command: Command | None = None
        self._command_s = -math.inf
        self._command_stamps = StampWatch('command', limits.command_timeout_s)
        self._pose: tuple[Position, float, int] | None = None
        self._pose_stamps = StampWatch('pose', limits.pose_timeout_s)
        self._delays = DelayWatch(settings.vehicle_delay_s)
        self._late_s = self._late_at_s = self._pose_delay_s = 0.0
        self._returned = False
        self._jump, self._jump_s = '', -math.inf
        self._left_by_jump, self._track_s = '', 0.0
        self._believed: Vector | None = None
        self._back = ReturnInside(limits.fence) if limits.fence is not None and settings.return_inside else None
        self._path = FlownPath()
        self._flown: Vector = ZERO
        self._flown_s = -math.inf
        self._moving: Point = ZERO[:2]
        self.latched = self.condition = ''

    @property
    def returning(self) -> bool:
        """The vehicle is being brought back inside the fence."""
        return self._back is not None and self._back.active

    # -- what arrives ------------------------------------------------------------------------
    def pose(
        self, position_enu_m: Vector, frame_id: str, now_s: float, *, stamp_ns: int = 0, now_ns: int = 0, doubt: str = '',
    ) -> None:
        """A pose arrives.

        Args:
            position_enu_m: (3,) in the map frame.
            frame_id: must be 'map'.
            now_s: steady time of its arrival.
            stamp_ns: its time by its sender's clock (since boot will do); 0: unknown.
            now_ns: our clock, which `stamp_ns` is compared with; 0: they are of different clocks.
            doubt: why the estimator's position is not to be trusted, '' if it is.
        """
        wrong = self._pose_stamps.doubt(stamp_ns, now_ns, now_s) if now_ns else ''
        delay_s = self._delays.arrived(stamp_ns, now_s, now_ns) if stamp_ns > 0 else 0.0
        self._watch_delay(delay_s, now_s)
        if self._overtaken(stamp_ns, delay_s):
            return
        if not wrong and self._pose is not None:
            self._watch_jump(position_enu_m, now_s, stamp_ns)
        self._pose, self._pose_delay_s = (Position(position_enu_m, frame_id, 0.0, doubt or wrong), now_s, stamp_ns), delay_s

    def _overtaken(self, stamp_ns: int, delay_s: float) -> bool:
        """Whether a newer pose came before, or the same one; not after the sender's clock was set back."""
        behind_s = (self._pose[2] - stamp_ns) / NS if self._pose is not None and stamp_ns > 0 else -1.0
        return behind_s >= 0.0 and delay_s >= behind_s / 2.0

    def _watch_delay(self, delay_s: float, now_s: float) -> None:
        """The longest of the last IN_TIME_S counts, so that a delay that jitters makes less flicker."""
        if delay_s >= self._late_s or now_s - self._late_at_s > IN_TIME_S:
            self._late_s, self._late_at_s = delay_s, now_s

    def _watch_jump(self, position: Vector, now_s: float, stamp_ns: int) -> None:
        assert self._pose is not None
        last, last_s, last_ns = self._pose
        stamped_s = min(max(0.0, (stamp_ns - last_ns) / NS), LONGEST_STAMPED_S) if stamp_ns and last_ns else 0.0
        passed_s = max(now_s - last_s, stamped_s)
        moved_m = math.dist(position, last.position_enu_m)
        if self._believed is None or (self._track_s >= SETTLED_S and not self._left_by_jump):
            self._believed = last.position_enu_m
        jumped = self._settings.jump_m > 0.0 and not moved_m <= self._settings.jump_m + PLAUSIBLE_M_S * passed_s
        may_hide_one = moved_m > self._settings.jump_m and passed_s > HIDES_JUMP_S
        self._track_s = 0.0 if jumped or may_hide_one else self._track_s + passed_s
        if jumped:
            self._jump, self._jump_s = f'it jumped {moved_m:.1f} m in {passed_s:.2f} s', now_s
            self._left_by_jump = f'it jumped {moved_m:.1f} m'
        if self._left_by_jump and math.dist(position, self._believed) <= self._settings.jump_m:
            self._left_by_jump = ''  # It jumped back.

    def clock_bounds(self, low_s: float, high_s: float, now_s: float) -> None:
        """Steady time minus the clock of the poses' stamps is between these (TIMESYNC); see `DelayWatch.bounded`.

        Args:
            low_s, high_s: bounds of the difference.
            now_s: steady time.
        """
        self._path.answered(now_s - (high_s - low_s))
        if self._delays.bounded(low_s, high_s, now_s):
            self._late_s = self._pose_delay_s = 0.0

    def round_trip(self, duration_s: float) -> None:
        """A question to the vehicle was answered; what positions are not late of it, commands are.

        Args:
            duration_s: from question to answer.
        """
        self.uplink(duration_s - self._pose_delay_s - self._settings.vehicle_delay_s)

    def uplink(self, delay_s: float) -> None:
        """Commands are under way for longer than `vehicle_delay_s` allows for; the vehicle stands later.

        Args:
            delay_s: how much longer.
        """
        self._uplink_s = max(0.0, delay_s) if math.isfinite(delay_s) else self._uplink_s

    def command(self, command: Command, now_s: float, *, stamp_ns: int = 0, now_ns: int = 0) -> None:
        """A command arrives now; its age and doubt are set here.

        Args:
            command: what is asked for.
            now_s: steady time.
            stamp_ns: of its header.
            now_ns: our clock; 0 if it has not begun.
        """
        doubt = self._command_stamps.doubt(stamp_ns, now_ns, now_s)
        self._command, self._command_s = command._replace(age_s=0.0, doubt=doubt), now_s

    def clear(self) -> None:
        """Nobody commands any more: the next command starts from rest."""
        self._command, self._flown, self._path, self.condition = None, ZERO, FlownPath(), ''
        self._returned = False
        if self._back is not None:
            self._back.end()

    # -- stop --------------------------------------------------------------------------------
    def stop(self, why: str) -> None:
        """Zero velocity until `release`."""
        self.latched = self.latched or why

    def release(self) -> str:
        """End a stop, and trust a position that jumped out of the fence or, where nothing else can decide that, comes late.

        Returns:
            Why the vehicle stood, '' if it did not.
        """
        late = self._lateness()
        why, self.latched = self.latched or self._left_by_jump or late, ''
        self._left_by_jump = ''
        if late and PAUSED in why and not self._delays.bounded_now:
            self._delays.forget()
            self._late_s = 0.0
        return why

    # -- verdict -----------------------------------------------------------------------------
    def verdict(self, now_s: float) -> GuardVerdict | None:
        """What may be flown now; None before the first command, unless the vehicle is or was brought back inside.

        Args:
            now_s: steady time.
        """
        limits, position = self._limits_now(), self._position(now_s)
        self._moving = self._obeyed(now_s)
        command = None if self._command is None else self._command._replace(age_s=now_s - self._command_s)
        verdict = self._judged(command, position, limits, now_s)
        self._returned |= self.returning
        if command is None and self.condition == 'silence' and not self._returned:
            return None
        self._flown, self._flown_s = verdict.velocity_enu_m_s, now_s
        self._path.add(self._flown, now_s)
        return verdict

    def position_doubt(self, now_s: float) -> str:
        """Why the position is not to be trusted now, '' if it is.

        Args:
            now_s: steady time.
        """
        late = self._lateness()
        return rules.pose_doubt(self._position(now_s), self._given) or (f'pose refused: {late}' if late else '')

    def _limits_now(self) -> Limits:
        """With the time that commands and positions are under way now; a late position is not flown by."""
        under_way_s = self._uplink_s + min(self._late_s, self._given.pose_timeout_s)
        return replace(self._given, reaction_s=self._given.reaction_s + REACTIONS * under_way_s)

    def _judged(self, command: Command | None, position: Position | None, limits: Limits, now_s: float) -> GuardVerdict:
        late = self._lateness()
        known = position if position is None or not late or position.doubt else position._replace(doubt=late)
        doubt = rules.doubt_of(command, known, limits)
        silent = command is None or not 0.0 <= command.age_s <= limits.command_timeout_s
        # A pilot who falls silent has ended his flight; that needs no release.
        if doubt and self._settings.latch and not silent:
            self.stop(doubt)
        if self.latched:
            self._end_return()
            return self._said('stop', GuardVerdict(ZERO, 0.0, f'stopped until released: {self.latched}'))
        flown = GuardVerdict(ZERO, 0.0, doubt) if doubt or command is None else self._slowed(command, position, limits, now_s)
        back = self._way_back(position, limits, now_s)
        if back is not None and (doubt or not as_good(flown.velocity_enu_m_s, back)):
            return self._said('return', GuardVerdict(self._ramped(back, now_s), 0.0, self._words_of_return(late)))
        if self._left_by_jump and position is not None and rules.outside(limits, position.position_enu_m):
            flown = flown._replace(reason=f'{flown.reason}; {NOT_BROUGHT.format(self._left_by_jump)}')
        if doubt:
            return self._said('silence' if silent else 'doubt', flown)
        return self._said('limited' if flown.reason else '', flown)

    def _said(self, condition: str, verdict: GuardVerdict) -> GuardVerdict:
        self.condition = condition
        return verdict

    def _lateness(self) -> str:
        """Why positions that arrive are of long ago, or ''."""
        if self._late_s <= self._given.pose_timeout_s:
            return ''
        remedy = SLOW if self._delays.bounded_now else PAUSED
        return f'it came {self._late_s:.1f} s late ({remedy})'

    # -- the way back inside -----------------------------------------------------------------
    def _way_back(self, position: Position | None, limits: Limits, now_s: float) -> Vector | None:
        """The velocity that brings the vehicle back inside the fence, None if it is not to be brought."""
        if self._back is None or limits.fence is None:
            return None
        under_way_s = self._pose_delay_s + self._uplink_s
        if position is None or rules.pose_doubt(position, limits) or under_way_s > LATEST_S:
            self._end_return()
            return None
        long_s = under_way_s if under_way_s > self._given.pose_timeout_s else 0.0
        at = position.position_enu_m
        if not rules.outside(limits, at):
            self._left_by_jump = ''
        if self._left_by_jump:
            return None
        # Where it will be when all that is under way to it has been flown.
        there = moved(at, self._path.since(now_s - position.age_s - long_s, now_s)) if long_s else at
        braking = Braking(limits.braking_m_s2, limits.reaction_s)
        return self._back.velocity(there, braking, spare_m=DRIFT_M_S * long_s, climbs=self._settings.lifts)

    def _words_of_return(self, late: str) -> str:
        assert self._back is not None
        by = f', by positions that come {self._pose_delay_s:.1f} s late' if late else ''
        return f'{self._back.reason}{by}: it is brought back inside'

    def _end_return(self) -> None:
        if self._back is not None:
            self._back.end()

    def _slowed(self, command: Command, position: Position | None, limits: Limits, now_s: float) -> GuardVerdict:
        """Speed first, so that growing slowly does not turn the direction of what is too fast."""
        wanted, fast = rules.limited(command.velocity_enu_m_s, limits)
        ramped = self._ramped(wanted, now_s)
        verdict = rules.check(command._replace(velocity_enu_m_s=ramped), position, limits)
        if position is not None:
            verdict = rules.held_back(verdict, position.position_enu_m, self._path.under_way(now_s), limits)
        if position is not None and rules.must_brake(self._moving, position, limits):
            standing = (0.0, 0.0, verdict.velocity_enu_m_s[2])
            return GuardVerdict(standing, verdict.yaw_rate_rad_s, 'fence ahead: it brakes before it turns')
        growing = f'acceleration limited to {self._settings.max_acceleration_m_s2:g} m/s2' if ramped != wanted else ''
        return verdict._replace(reason='; '.join(reason for reason in (fast, growing, verdict.reason) if reason))

    def _position(self, now_s: float) -> Position | None:
        if self._pose is None:
            return None
        position, at_s, _ = self._pose
        jump = self._jump if now_s - self._jump_s < SETTLED_S else ''
        return position._replace(age_s=now_s - at_s, doubt=position.doubt or jump)

    def _ramped(self, velocity: Vector, now_s: float) -> Vector:
        """Slower at once, faster at the acceleration; through zero at most."""
        change = self._settings.max_acceleration_m_s2 * min(now_s - self._flown_s, LONGEST_STEP_S)
        east, north, up = (
            min(max(wanted, min(0.0, now) - change), max(0.0, now) + change)
            for wanted, now in zip(velocity, self._flown, strict=True)
        )
        return east, north, up

    def _obeyed(self, now_s: float) -> Point:
        """The velocity in plan that what was flown has come to by now, in a vehicle that is as slow as it may be."""
        change = self._flown[0] - self._moving[0], self._flown[1] - self._moving[1]
        size, reached = math.hypot(*change), self._given.braking_m_s2 * (now_s - self._flown_s)
        share = 1.0 if size <= reached else reached / size
        return self._moving[0] + share * change[0], self._moving[1] + share * change[1]
