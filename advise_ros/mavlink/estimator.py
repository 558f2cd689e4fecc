"""Whether an autopilot's position is to be trusted, by its estimator's own word, its GPS, and how its positions move.

A shift of the GPS shows seconds before the estimator follows it: by the measurements that it rejects, and by
the GPS that is somewhere else than the position. The jump itself shows in positions that no velocity explains.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

from advise_ros.core.units import Vector
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.vehicle import Motion

# A reason that is not repeated by its source for this long is no reason any more.
FACT_S = 6.0
# A jump is over, and its position believed again, after this long.
SETTLED_S = 2.0
# One bad report may be a spike, and one good one a gap in a fault.
REPORTS = 2

# Test ratios: at 1 the estimator rejects what it is given.
REJECTS = 1.0
# Attitude, velocities and positions, as the take-off asks for them; of PX4 velocities and height, and one kind of position.
ARDUPILOT_NEEDS, PX4_NEEDS, PX4_POSITIONS = 0x33F, 0x026, 0x018
STANDS_STILL, ARDUPILOT_GLITCH, PX4_GLITCH = 0x080, 0x8000, 0x0400

FIX_3D = 3
EARTH_RADIUS_M = 6_378_100.0
# The GPS may be off the position by this, or by this many of its own standard deviations up to the limit,
NEAR_M, SIGMAS, FURTHEST_NEAR_M = 3.0, 3.0, 10.0
# and by what was flown since one of them was measured, and by another idea of the earth's radius.
LAG_S, SCALE_ERROR = 0.5, 0.002
# How fast the usual difference of both is learnt, on the ground and in the air.
LEARN_GROUND_S, LEARN_AIR_S = 5.0, 60.0

# Positions a window apart may differ by this from what the velocities explain, in plan and in height;
WINDOW_MS, ODD_M, ODD_HEIGHT_M = 1000, 2.0, 3.0
# two in a row by this, and by what a multicopter can do between them unseen.
STEP_M, STEP_HEIGHT_M, AGILE_M_S2 = 0.5, 1.0, 8.0
# After a longer gap nothing is compared.
GAP_MS = 1500


class Estimator:
    """Takes messages and positions as they come; `doubt` says what is wrong.

    The words of a reason keep the numbers of its begin, so that it stays one reason while it lasts.
    """

    def __init__(self) -> None:
        self._reasons: dict[str, tuple[str, float]] = {}
        self._bad: dict[str, int] = {}
        self._had_fix = False
        self._reset_counter: int | None = None
        self._in_air = False
        self._gps = GpsWatch()
        self._motions = MotionWatch()
        self._handlers: dict[int, Callable[[Message, float], None]] = {
            mav.EKF_STATUS_REPORT: self._on_ardupilot, mav.ESTIMATOR_STATUS: self._on_px4, mav.GPS_RAW_INT: self._on_gps,
            mav.ODOMETRY: self._on_odometry, mav.EXTENDED_SYS_STATE: self._on_landed,
        }

    def doubt(self, now_s: float) -> str:
        """Why the position is not to be trusted, '' if it is.

        Args:
            now_s: steady time.
        """
        return '; '.join(words for words, until_s in self._reasons.values() if now_s < until_s)

    def take(self, message: Message, at_s: float) -> None:
        """Take a message of the autopilot.

        Args:
            message: of any kind.
            at_s: steady time of arrival.
        """
        handler = self._handlers.get(message.get_msgId())
        if handler is not None:
            handler(message, at_s)

    def moved(self, motion: Motion) -> None:
        """A new position."""
        odd = self._motions.odd(motion)
        if odd:
            self._give('jump', odd, motion.at_s + SETTLED_S)

    # -- reasons -----------------------------------------------------------------------------
    def _give(self, name: str, words: str, until_s: float) -> None:
        known, known_s = self._reasons.get(name, ('', -math.inf))
        going_on = known_s > until_s - max(FACT_S, SETTLED_S)
        self._reasons[name] = (known if known and going_on else words, until_s)

    def _judge(self, name: str, words: str, at_s: float, reports: int = REPORTS) -> None:
        """Take a report that is bad by `words`, or good (''); several in a row begin or end a reason."""
        active = self._reasons.get(name, ('', -math.inf))[1] > at_s
        if bool(words) == active:
            self._bad[name] = 0
            if active:
                self._give(name, words, at_s + FACT_S)
            return
        self._bad[name] = self._bad.get(name, 0) + 1
        if self._bad[name] < reports:
            return
        self._bad[name] = 0
        if words:
            self._give(name, words, at_s + FACT_S)
        else:
            self._reasons.pop(name, None)

    # -- messages ----------------------------------------------------------------------------
    def _on_landed(self, message: Message, at_s: float) -> None:
        self._in_air = message.landed_state in (mav.IN_AIR, mav.TAKING_OFF, mav.LANDING)

    def _on_ardupilot(self, message: Message, at_s: float) -> None:
        has_position = message.flags & ARDUPILOT_NEEDS == ARDUPILOT_NEEDS and not message.flags & STANDS_STILL
        self._judge_flags(has_position, message.flags, ARDUPILOT_GLITCH, at_s)
        self._judge_ratios(at_s, {
            'velocity': message.velocity_variance, 'horizontal position': message.pos_horiz_variance,
            'height': message.pos_vert_variance, 'compass': message.compass_variance,
        })

    def _on_px4(self, message: Message, at_s: float) -> None:
        # On the ground PX4 says that it stands still whenever it does; in the air it holds a place that it makes up.
        made_up = self._in_air and message.flags & STANDS_STILL
        has_position = message.flags & PX4_NEEDS == PX4_NEEDS and message.flags & PX4_POSITIONS != 0 and not made_up
        self._judge_flags(has_position, message.flags, PX4_GLITCH, at_s)
        self._judge_ratios(at_s, {
            'velocity': message.vel_ratio, 'horizontal position': message.pos_horiz_ratio,
            'height': message.pos_vert_ratio, 'compass': message.mag_ratio,
        })

    def _judge_flags(self, has_position: bool, flags: int, glitch: int, at_s: float) -> None:
        self._judge('flags', '' if has_position else f'the estimator has no position (flags {flags:#x})', at_s, 1)
        self._judge('glitch', f'the estimator takes the GPS for faulty (flags {flags:#x})' if flags & glitch else '', at_s, 1)

    def _judge_ratios(self, at_s: float, ratios: dict[str, float]) -> None:
        bad = [f'{name} {ratio:.1f}' for name, ratio in ratios.items() if ratio >= REJECTS]
        words = f'the estimator rejects what it measures ({", ".join(bad)} of {REJECTS:g})' if bad else ''
        self._judge('ratios', words, at_s)

    def _on_gps(self, message: Message, at_s: float) -> None:
        fixed = message.fix_type >= FIX_3D
        self._had_fix = self._had_fix or fixed
        lost = self._had_fix and not fixed
        self._judge('fix', f'the GPS fix is lost (type {message.fix_type})' if lost else '', at_s, 1)
        if fixed and self._motions.newest is not None:
            self._judge('gps', self._gps.apart(message, self._motions.newest, at_s, in_air=self._in_air), at_s)

    def _on_odometry(self, message: Message, at_s: float) -> None:
        counter, before = int(message.reset_counter), self._reset_counter
        self._reset_counter = counter
        if before is not None and counter != before and self._in_air:
            self._give('reset', f'the estimator was reset (number {counter})', at_s + SETTLED_S)


class GpsWatch:
    """The GPS against the position: their usual difference is learnt, a larger one is odd in the air."""

    def __init__(self) -> None:
        self._origin_rad: tuple[float, float] | None = None
        self._usual_m: tuple[float, float] | None = None
        self._at_s = 0.0

    def apart(self, message: Message, motion: Motion, at_s: float, *, in_air: bool) -> str:
        """How far the GPS is off the position, in words; '' if it is near or the vehicle on the ground.

        Args:
            message: with the GPS's position.
            motion: position and velocity by the estimator.
            at_s: steady time of arrival.
            in_air: whether the vehicle flies.
        """
        east, north = self._local_m(message)
        x, y, _ = motion.position_enu_m
        now = east - x, north - y
        if self._usual_m is None:
            self._usual_m, self._at_s = now, at_s
            return ''
        off = now[0] - self._usual_m[0], now[1] - self._usual_m[1]
        off_m = math.hypot(*off)
        odd = in_air and off_m > self._allowed_m(message, motion, math.hypot(east, north))
        if not odd:
            share = min(1.0, max(0.0, at_s - self._at_s) / (LEARN_AIR_S if in_air else LEARN_GROUND_S))
            self._usual_m = self._usual_m[0] + share * off[0], self._usual_m[1] + share * off[1]
        self._at_s = at_s
        return f'the GPS is {off_m:.1f} m off the position' if odd else ''

    def _local_m(self, message: Message) -> tuple[float, float]:
        latitude, longitude = math.radians(message.lat / 1e7), math.radians(message.lon / 1e7)
        if self._origin_rad is None:
            self._origin_rad = latitude, longitude
        north = EARTH_RADIUS_M * (latitude - self._origin_rad[0])
        return EARTH_RADIUS_M * (longitude - self._origin_rad[1]) * math.cos(self._origin_rad[0]), north

    @staticmethod
    def _allowed_m(message: Message, motion: Motion, away_m: float) -> float:
        accuracy_m = getattr(message, 'h_acc', 0) / 1000.0
        near_m = min(max(NEAR_M, SIGMAS * accuracy_m), FURTHEST_NEAR_M)
        return near_m + LAG_S * math.hypot(*motion.velocity_enu_m_s[:2]) + SCALE_ERROR * away_m


class MotionWatch:
    """Positions against the velocities that come with them, by the autopilot's own time.

    Attributes:
        newest: the last position.
    """

    def __init__(self) -> None:
        self.newest: Motion | None = None
        # (time, what positions moved beyond the integral of velocities since the first one).
        self._unexplained: deque[tuple[int, Vector]] = deque()

    def odd(self, motion: Motion) -> str:
        """What is odd about how the vehicle came to a new position, in words, '' if nothing."""
        last, self.newest = self.newest, motion
        gap_ms = motion.time_boot_ms - last.time_boot_ms if last is not None else -1
        if last is None or not 0 < gap_ms <= GAP_MS:
            self._unexplained = deque([(motion.time_boot_ms, (0.0, 0.0, 0.0))])
            return ''
        step = _unexplained_m(last, motion, gap_ms / 1000.0)
        before = self._unexplained[-1][1]
        self._unexplained.append((motion.time_boot_ms, (before[0] + step[0], before[1] + step[1], before[2] + step[2])))
        while motion.time_boot_ms - self._unexplained[0][0] > WINDOW_MS and len(self._unexplained) > 2:
            self._unexplained.popleft()
        unseen_m = AGILE_M_S2 * (gap_ms / 1000.0) ** 2 / 8.0
        since_ms, first = self._unexplained[0]
        total = tuple(now - then for now, then in zip(self._unexplained[-1][1], first, strict=True))
        return _too_far(step, gap_ms, STEP_M + unseen_m, STEP_HEIGHT_M + unseen_m) or _too_far(
            total, motion.time_boot_ms - since_ms, ODD_M + unseen_m, ODD_HEIGHT_M + unseen_m)


def _unexplained_m(before: Motion, after: Motion, seconds: float) -> Vector:
    """(3,) what the position moved beyond the mean of both velocities."""
    east, north, up = (
        now - then - (v_then + v_now) / 2.0 * seconds for then, now, v_then, v_now in zip(
            before.position_enu_m, after.position_enu_m, before.velocity_enu_m_s, after.velocity_enu_m_s, strict=True)
    )
    return east, north, up


def _too_far(moved: tuple[float, ...], passed_ms: int, plan_m: float, height_m: float) -> str:
    east, north, up = moved
    if math.hypot(east, north) <= plan_m and abs(up) <= height_m:
        return ''
    moved_m, passed_s = math.hypot(east, north, up), passed_ms / 1000.0
    return f'the position moved by {moved_m:.1f} m in {passed_s:.2f} s that its velocity does not explain'
