"""How old a message is by the time a callback gets it: a process that was held up finds old ones in its queue."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping

from advise_ros.core.units import NS

# The shortest way of a message is that of the last window or two.
WINDOW_S = 2.0
# A longer wait is none: somebody's clock was set.
LONGEST_S = 30.0


class ArrivalWatch:
    """Measures how much longer a message was under way than others of its topic were lately.

    The publisher's clock and ours may differ by any amount; a clock that is set by less than LONGEST_S makes
    messages look late for up to two windows.
    """

    def __init__(self) -> None:
        self._since_s = -math.inf
        self._shortest_s = self._before_s = math.inf

    def waited_s(self, info: Mapping[str, int]) -> float:
        """Seconds that it waited; 0 where the middleware does not say.

        Args:
            info: what rclpy hands to a callback beside the message.
        """
        sent_ns = info.get('source_timestamp') or 0
        if sent_ns <= 0:
            return 0.0
        way_s, now_s = (time.time_ns() - sent_ns) / NS, time.monotonic()
        if way_s - min(self._shortest_s, self._before_s) > LONGEST_S:
            self._shortest_s = self._before_s = math.inf
        if now_s - self._since_s > WINDOW_S:
            self._since_s, self._before_s, self._shortest_s = now_s, self._shortest_s, math.inf
        self._shortest_s = min(self._shortest_s, way_s)
        return way_s - min(self._shortest_s, self._before_s)
