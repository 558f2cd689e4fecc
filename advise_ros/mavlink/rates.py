"""Keeps an autopilot's messages coming at the rates that we need, even if another component asks for others on the same link.

MAVProxy asks for everything at 4 Hz every 15 s, which undoes what a companion behind it has asked for.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.vehicle import Vehicle

# A message is asked for again when it was silent this long, or this many of its periods.
SILENT_S, SILENT_PERIODS = 2.0, 5.0
# It comes too seldom at less than this share of its rate over a window; bad links and slow simulations stay above it.
ENOUGH, WINDOW_S = 0.4, 1.0
ASK_S = 1.0
# An autopilot that still does not send it is asked less often.
ASKS_IN_A_ROW, ASK_SELDOM_S = 30, 10.0
# What only doubts come from, and what not every autopilot has, is asked for so often in a row.
ASKS_FOR_DOUBTS = 5
DOUBTS = frozenset({mav.GPS_RAW_INT, mav.ESTIMATOR_STATUS, mav.ODOMETRY})
# What some autopilots do not know, and complain of in a text, is asked for so often until it came once.
OPTIONAL, OPTIONAL_ASKS = frozenset((mav.CURRENT_MODE,)), 3


@dataclass
class _Watched:
    """One message: when it was asked for last and how often in vain, and its count at the begin of a window."""

    asked_s: float = -math.inf
    asks: int = 0
    since_s: float = -math.inf
    count: int = 0
    seldom: bool = False


class RateWatch:
    """Requests for messages that were never asked for, do not arrive, or arrive too seldom."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._vehicle = vehicle
        self._watched: dict[int, _Watched] = {}

    def forget(self) -> None:
        """The link was lost: ask for all of them anew."""
        self._watched.clear()

    def due(self, wanted: Iterable[tuple[int, float]], now_s: float) -> list[Message]:
        """Requests to send now.

        Args:
            wanted: pairs of message id and rate [Hz].
            now_s: steady time.
        """
        target = self._vehicle.target
        if target is None:
            return []
        asked = [(number, rate_hz) for number, rate_hz in wanted if self._is_due(number, rate_hz, now_s)]
        return [mav.message_interval(target, number, rate_hz) for number, rate_hz in asked]

    def _is_due(self, number: int, rate_hz: float, now_s: float) -> bool:
        watched = self._watched.setdefault(number, _Watched())
        periods_s = SILENT_PERIODS / rate_hz
        self._count(watched, number, rate_hz * ENOUGH, max(WINDOW_S, periods_s), now_s)
        silent = now_s - self._vehicle.received_at_s.get(number, -math.inf) > max(SILENT_S, periods_s)
        if number in OPTIONAL and watched.asks >= OPTIONAL_ASKS and not self._vehicle.n_received[number]:
            return False
        in_a_row = ASKS_FOR_DOUBTS if number in DOUBTS else ASKS_IN_A_ROW
        wait_s = ASK_S if watched.asks < in_a_row else ASK_SELDOM_S
        if watched.asks and not ((silent or watched.seldom) and now_s - watched.asked_s >= wait_s):
            return False
        self._watched[number] = _Watched(now_s, watched.asks + 1, count=self._vehicle.n_received[number])
        return True

    def _count(self, watched: _Watched, number: int, least_hz: float, window_s: float, now_s: float) -> None:
        """Judge the rate once a window; the first one begins with the first message after a request."""
        count = self._vehicle.n_received[number]
        if watched.since_s == -math.inf:
            if count != watched.count:
                watched.since_s, watched.count = now_s, count
        elif now_s - watched.since_s >= window_s:
            watched.seldom = (count - watched.count) / (now_s - watched.since_s) < least_hz
            watched.asks = watched.asks if watched.seldom else 1
            watched.since_s, watched.count = now_s, count
