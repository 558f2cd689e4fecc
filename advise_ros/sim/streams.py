"""Which messages a link gets by themselves, and when each is due."""

from __future__ import annotations

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.core.units import NS


class Streams:
    """Which messages are sent by themselves, and when; times are simulated nanoseconds."""

    def __init__(self) -> None:
        self._interval_ns = {int(mavlink.MAVLINK_MSG_ID_HEARTBEAT): NS}
        self._due_ns = {int(mavlink.MAVLINK_MSG_ID_HEARTBEAT): 0}

    def set(self, message_id: int, interval_ns: int, now_ns: int) -> None:
        """Send a message whenever the time is a multiple of the interval, so that stamps are evenly spaced.

        Args:
            message_id: what is sent.
            interval_ns: simulated.
            now_ns: simulated time.
        """
        self._interval_ns[message_id] = interval_ns
        self._due_ns[message_id] = _next_multiple(interval_ns, now_ns)

    def hurry(self, message_id: int, now_ns: int) -> None:
        """Send a message that is sent anyway with the next tick.

        Args:
            message_id: what is sent.
            now_ns: simulated time.
        """
        if message_id in self._due_ns:
            self._due_ns[message_id] = now_ns

    def stop(self, message_id: int) -> None:
        """Send a message no more."""
        self._interval_ns.pop(message_id, None)
        self._due_ns.pop(message_id, None)

    def due(self, now_ns: int) -> list[int]:
        """The messages whose time has come; what was missed is not caught up.

        Args:
            now_ns: simulated time.
        """
        ready = [message_id for message_id, due_ns in self._due_ns.items() if due_ns <= now_ns]
        for message_id in ready:
            self._due_ns[message_id] = _next_multiple(self._interval_ns[message_id], now_ns)
        return ready


def _next_multiple(interval_ns: int, now_ns: int) -> int:
    return (now_ns // interval_ns + 1) * interval_ns
