"""The guard over time: what arrived and when, jumps of the position, how fast the velocity grows, and the latched stop."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from advise_ros.core import guard
from advise_ros.core.fence import Point, Vector
from advise_ros.core.guard import ZERO, Command, Limits, Position, Verdict
from advise_ros.core.stamp_watch import NS, StampWatch

# A pause in checking is no licence to accelerate.
LONGEST_STEP_S = 0.1
# No multicopter of this package is faster.
PLAUSIBLE_M_S = 20.0
# A position that jumped is believed again when it was steady for this long.
SETTLED_S = 1.0
# A delay counts twice, as in `Limits.reaction_s`.
REACTIONS = 2.0
# Stamps count for as much as this; their clock may run faster than steady time (simulation).
LONGEST_STAMPED_S = 5.0


@dataclass(frozen=True)
class MonitorSettings:
    """What the guard remembers for.

    Attributes:
        max_acceleration_m_s2: how fast each axis of the velocity may grow; slowing down is free.
        jump_m: a position may jump this far beyond what flying explains; 0: any.
        latch: whether a doubt stops the vehicle until it is released.
    """

    max_acceleration_m_s2: float = 10.0
    jump_m: float = 2.0
    latch: bool = False


class GuardMonitor:
    """Takes poses and commands as they arrive, says what may be flown now. All times are steady.

    Attributes:
        latched: why the vehicle is stopped until `release`, '' if it is not.
    """

    def __init__(self, limits: Limits, settings: MonitorSettings) -> None:
        self._given, self._settings = limits, settings
        self._uplink_s = 0.0
        self._command: Command | None = None
        self._command_s = -math.inf
        self._command_stamps = StampWatch('command', limits.command_timeout_s)
        self._pose: tuple[Position, float, int] | None = None
        self._pose_stamps = StampWatch('pose', limits.pose_timeout_s)
        self._jump = ''
        self._jump_s = -math.inf
        self._flown: Vector = ZERO
        self._flown_s = -math.inf
        self._moving: Point = ZERO[:2]
        self.latched = ''

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
        doubt = doubt or (self._pose_stamps.doubt(stamp_ns, now_ns, now_s) if now_ns else '')
        if not doubt and self._pose is not None:
            self._watch_jump(position_enu_m, now_s, stamp_ns)
        self._pose = Position(position_enu_m, frame_id, 0.0, doubt), now_s, stamp_ns

    def _watch_jump(self, position: Vector, now_s: float, stamp_ns: int) -> None:
        assert self._pose is not None
        last, last_s, last_ns = self._pose
        stamped_s = min(max(0.0, (stamp_ns - last_ns) / NS), LONGEST_STAMPED_S) if stamp_ns and last_ns else 0.0
        passed_s = max(now_s - last_s, stamped_s)
        moved_m = math.dist(position, last.position_enu_m)
        if self._settings.jump_m > 0.0 and not moved_m <= self._settings.jump_m + PLAUSIBLE_M_S * passed_s:
            self._jump, self._jump_s = f'it jumped {moved_m:.1f} m in {passed_s:.2f} s', now_s

    def uplink(self, delay_s: float) -> None:
        """Commands are under way for this much longer than `vehicle_delay_s` allows for (s); the vehicle stands later."""
        self._uplink_s = max(0.0, delay_s) if math.isfinite(delay_s) else self._uplink_s

    @property
    def _limits(self) -> Limits:
        """With the time that commands and positions are under way now."""
        return replace(self._given, reaction_s=self._given.reaction_s + REACTIONS * self._uplink_s)

    def command(self, command: Command, now_s: float, *, stamp_ns: int = 0, now_ns: int = 0) -> None:
        """A command arrives now; its age and doubt are set here."""
        doubt = self._command_stamps.doubt(stamp_ns, now_ns, now_s)
        self._command, self._command_s = command._replace(age_s=0.0, doubt=doubt), now_s

    def clear(self) -> None:
        """Nobody commands any more: the next command starts from rest."""
        self._command, self._flown = None, ZERO

    # -- stop --------------------------------------------------------------------------------
    def stop(self, why: str) -> None:
        """Zero velocity until `release`."""
        self.latched = self.latched or why

    def release(self) -> str:
        """End a stop; returns why there was one, '' if there was none."""
        why, self.latched = self.latched, ''
        return why

    # -- verdict -----------------------------------------------------------------------------
    def verdict(self, now_s: float) -> Verdict | None:
        """What may be flown now, None before the first command."""
        if self._command is None:
            return None
        self._moving = self._obeyed(now_s)
        verdict = self._judged(self._command._replace(age_s=now_s - self._command_s), now_s)
        self._flown, self._flown_s = verdict.velocity_enu_m_s, now_s
        return verdict

    def _judged(self, command: Command, now_s: float) -> Verdict:
        position = self._position(now_s)
        doubt = guard.doubt_of(command, position, self._limits)
        # A pilot who falls silent has ended his flight; that needs no release.
        if doubt and self._settings.latch and command.age_s <= self._limits.command_timeout_s:
            self.stop(doubt)
        if self.latched:
            return Verdict(ZERO, 0.0, f'stopped until released: {self.latched}')
        if doubt:
            return Verdict(ZERO, 0.0, doubt)
        return self._slowed(command, position, now_s)

    def _slowed(self, command: Command, position: Position | None, now_s: float) -> Verdict:
        """Speed first, so that growing slowly does not turn the direction of what is too fast."""
        wanted, fast = guard.limited(command.velocity_enu_m_s, self._limits)
        ramped = self._ramped(wanted, now_s)
        verdict = guard.check(command._replace(velocity_enu_m_s=ramped), position, self._limits)
        if position is not None and guard.must_brake(self._moving, position, self._limits):
            standing = (0.0, 0.0, verdict.velocity_enu_m_s[2])
            return Verdict(standing, verdict.yaw_rate_rad_s, 'fence ahead: it brakes before it turns')
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
        size, reached = math.hypot(*change), self._limits.braking_m_s2 * (now_s - self._flown_s)
        share = 1.0 if size <= reached else reached / size
        return self._moving[0] + share * change[0], self._moving[1] + share * change[1]
