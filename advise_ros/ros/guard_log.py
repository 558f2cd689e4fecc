"""What a guard logs and shows of itself: each condition once, what belongs to every flight not at all."""

from __future__ import annotations

from advise_ros.core.guard.monitor import GuardMonitor
from advise_ros.ros.change_log import LASTING_S, ChangeLog

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
