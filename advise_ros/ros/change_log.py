"""Logs each change of a node's condition once: when it begins, when its reason changes, and when it ends.

The bridge logs its vehicle by it (`VehicleLog`), guard and bridge their checks (`GuardLog`).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import Protocol

from advise_ros.core.guard.monitor import GuardMonitor
from advise_ros.mavlink.companion import Status

# A condition that comes back within this is the same one still; its end is not logged.
QUIET_S = 1.0
# One that has to last before it is logged may pause for this long meanwhile.
PAUSE_S = 0.2
# Conditions of normal flight (a speed that is limited) are logged when they last for this long.
LASTING_S = 2.0
# Figures in a sentence change all the time and are no news.
FIGURES = re.compile(r'-?\d[\d.]*')


class MessageLog(Protocol):
    """What is needed of a node's logger."""

    def info(self, message: str) -> object: ...

    def warning(self, message: str) -> object: ...


@dataclass
class Condition:
    """What is known of one condition.

    Attributes:
        since_s: it has been there since; inf while it is not.
        seen_s: it was there last.
        logged: sentences of this time, without their figures.
    """

    since_s: float = math.inf
    seen_s: float = -math.inf
    logged: set[str] = field(default_factory=set)


class ChangeLog:
    """Writes changes to a node's log; call `note` as often as you like. Times are steady.

    Example:
        log.note('doubt', verdict.reason, now_s)    # '' when there is none
    """

    def __init__(self, logger: MessageLog) -> None:
        self._to = logger
        self._conditions: dict[str, Condition] = {}

    def note(self, name: str, sentence: str, now_s: float, *, lasting_s: float = 0.0, calm: bool = False) -> bool:
        """Log a condition that begins or changes by its sentence, and its end.

        Returns:
            Whether it is there and was logged, so that it may be shown as a warning without flicker.

        Args:
            name: of the condition, as its end is logged: 'NAME is over after 3.2 s'.
            sentence: what it is now; '' when there is none. Another figure in it is no change.
            lasting_s: it is logged when it lasts for this long.
            calm: whether it is normal (INFO) and no WARN.
        """
        condition = self._conditions.setdefault(name, Condition())
        if sentence:
            self._begin(condition, sentence, now_s, lasting_s, calm=calm)
        elif condition.since_s < math.inf and now_s - condition.seen_s >= QUIET_S:
            if condition.logged:
                self._to.info(f'{name} is over after {condition.seen_s - condition.since_s:.1f} s')
            self._conditions[name] = condition = Condition()
        return bool(condition.logged)

    def _begin(self, condition: Condition, sentence: str, now_s: float, lasting_s: float, *, calm: bool) -> None:
        paused = not condition.logged and now_s - condition.seen_s > PAUSE_S
        condition.since_s = now_s if lasting_s > 0.0 and paused else min(condition.since_s, now_s)
        condition.seen_s = now_s
        what = FIGURES.sub('#', sentence)
        if now_s - condition.since_s < lasting_s or what in condition.logged:
            return
        condition.logged.add(what)
        if calm:
            self._to.info(sentence)
        else:
            self._to.warning(sentence)

    def now(self, name: str, sentence: str, *, calm: bool = True) -> None:
        """Log something that happens at one moment if it differs from the last of its name ('owner', 'link')."""
        condition = self._conditions.setdefault(name, Condition())
        if sentence in condition.logged or not sentence:
            return
        condition.logged = {sentence}
        if calm:
            self._to.info(sentence)
        else:
            self._to.warning(sentence)


FAILED = 'another try: '


class VehicleLog:
    """Logs the link, the owner of the vehicle, its failsafe, and goals that failed after they had begun."""

    def __init__(self, log: ChangeLog) -> None:
        self._log = log
        self._met = self._armed = False

    def look(self, status: Status, now_s: float, *, under_way: bool = False) -> None:
        """Log what has changed; call it as often as you like.

        Args:
            status: the vehicle's.
            now_s: steady time.
            under_way: whether a goal of ours is.
        """
        lost = self._met and not status.connected
        self._met = self._met or status.connected
        self._log.note('the loss of the link', status.waiting_for.removeprefix('heartbeat: ') if lost else '', now_s)
        if not status.connected:
            return
        self._log.note('the failsafe', f'the autopilot is in a failsafe: {status.failsafe}' if status.failsafe else '', now_s)
        failed = status.waiting_for.removeprefix(FAILED) if status.waiting_for.startswith(FAILED) else ''
        self._log.note('the last failure', failed, now_s)
        self._note_owner(status, under_way=under_way)

    def _note_owner(self, status: Status, *, under_way: bool) -> None:
        self._armed = self._armed or status.armed
        if status.owner == 'ours':
            self._log.now('owner', "it is this bridge's: it took off or was taken over here")
        elif status.owner == 'others' and status.in_air and not under_way:
            why = status.waiting_for.removeprefix('mavlink_bridge/take_over: ')
            self._log.now('owner', f"it is others', and gets no commands from here: {why}", calm=False)
        elif self._armed and not status.armed:
            self._log.now('owner', "it is disarmed, and nobody's")


# A doubt of the pose while nobody commands is news when it lasts for this long.
DOUBTED_S = 1.0
NO_POSE = 'no pose yet'


class GuardLog:
    """Logs stops, doubts, returns, silences and limits, with or without commands."""

    def __init__(self, log: ChangeLog) -> None:
        self._log = log

    def look(self, monitor: GuardMonitor, reason: str, now_s: float, *, alarms: bool = True) -> tuple[str, bool]:
        """Log what begins and ends.

        Args:
            monitor: the guard after its last verdict.
            reason: of that verdict, '' where nobody commands.
            now_s: steady time.
            alarms: whether a doubt while nobody commands is a warning; false for a vehicle at rest.

        Returns:
            What the guard says now, and whether that is worth a warning: the same is in the log.
        """
        log, condition = self._log, monitor.condition
        log.note('the stop', f'stopped until released: {monitor.latched}' if monitor.latched else '', now_s)
        log.note('the return inside the fence', reason if condition == 'return' else '', now_s)
        log.note('the silence', reason if condition == 'silence' else '', now_s, calm=True)
        limited = log.note('the limit', reason if condition == 'limited' else '', now_s, lasting_s=LASTING_S)
        doubted, doubt = self._doubt(monitor, reason, now_s, alarms=alarms)
        if condition in ('stop', 'return', 'doubt'):
            return reason, True
        if doubted and doubt:
            return f'{reason}; {doubt}' if reason else doubt, alarms
        return reason, limited and condition == 'limited'

    def _doubt(self, monitor: GuardMonitor, reason: str, now_s: float, *, alarms: bool) -> tuple[bool, str]:
        """Whether a doubt is in the log, and what it is."""
        commanded = monitor.condition == 'doubt'
        pose = monitor.position_doubt(now_s) if monitor.condition != 'return' else ''
        doubt = reason if commanded else '' if pose == NO_POSE else pose
        wait_s = 0.0 if commanded else DOUBTED_S
        alarm, calm = (doubt, '') if alarms or commanded else ('', doubt)
        loud = self._log.note('the doubt', alarm, now_s, lasting_s=wait_s)
        quiet = self._log.note('the doubt at rest', calm, now_s, lasting_s=wait_s, calm=True)
        return loud or quiet, doubt
