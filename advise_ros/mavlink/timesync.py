"""How long a message takes to the autopilot and back, and where its clock stands, by TIMESYNC.

https://mavlink.io/en/services/timesync.html
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from advise_ros.core.units import NS
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.messages import Message

ASK_S = 0.25
# The slowest answer of this long counts: a delay that jitters is as long as its longest.
RECENT_S = 2.0
# Losses leave some questions without an answer; from here on their age counts as delay.
SILENT_S = 1.5
# Questions that are waited for; an autopilot that answers none is not asked in vain for ever more of them.
OPEN = 64
# Answers that wait to be sent; only a flood of questions makes more.
UNSENT = 16


class Bounds(NamedTuple):
    """Our steady time minus the autopilot's time since boot lies between these, seconds."""

    low_s: float
    high_s: float


class Timesync:
    """Asks the autopilot for its time, answers when it asks for ours. Times are steady.

    A round trip does not show how long each of the two ways takes, so nothing here says that: it is
    no longer than the round trip, and the truth lies between `bounds`.

    Attributes:
        bounds: by the last answer, None before the first.
    """

    def __init__(self) -> None:
        self._asked_s = float('-inf')
        self._open: dict[int, float] = {}
        self._answered: deque[tuple[float, float]] = deque()
        self._unsent: deque[Message] = deque(maxlen=UNSENT)
        self.bounds: Bounds | None = None

    def forget(self) -> None:
        """The link was lost: what is under way will not be answered."""
        self._open.clear()
        self._answered.clear()
        self._unsent.clear()

    def due(self, now_s: float) -> list[Message]:
        """What to send now, at once.

        Args:
            now_s: steady time.
        """
        out = list(self._unsent)
        self._unsent.clear()
        if now_s - self._asked_s >= ASK_S:
            self._asked_s = now_s
            asked_ns = round(now_s * NS)
            self._open[asked_ns] = now_s
            for old in list(self._open)[:-OPEN]:
                del self._open[old]
            out.append(mav.dialect.MAVLink_timesync_message(0, asked_ns))
        return out

    def take(self, message: Message, at_s: float) -> None:
        """Take a TIMESYNC of the autopilot: a question, or the answer to one of ours.

        Args:
            message: the TIMESYNC.
            at_s: steady time of arrival.
        """
        if not message.tc1:
            self._unsent.append(mav.dialect.MAVLink_timesync_message(round(at_s * NS), message.ts1))
            return
        asked_s = self._open.pop(int(message.ts1), None)
        if asked_s is None:
            return  # Of another sender, or a repetition.
        theirs_s = message.tc1 / NS
        self.bounds = Bounds(asked_s - theirs_s, at_s - theirs_s)
        self._answered.append((at_s, at_s - asked_s))

    def round_trip_s(self, now_s: float) -> float | None:
        """Recent round trip; None while no answer has come.

        Args:
            now_s: steady time.
        """
        while len(self._answered) > 1 and now_s - self._answered[0][0] > RECENT_S:
            self._answered.popleft()
        if not self._answered:
            return None
        slowest_s = max(took_s for _, took_s in self._answered)
        last_s = self._answered[-1][0] - self._answered[-1][1]  # When the last answered question was asked.
        waited_s = max((now_s - asked_s for asked_s in self._open.values() if asked_s > last_s), default=0.0)
        return max(slowest_s, waited_s if waited_s > SILENT_S else 0.0)
