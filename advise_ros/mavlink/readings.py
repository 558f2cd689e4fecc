"""An autopilot's parameters, asked for by name; nothing is set.

https://mavlink.io/en/services/parameter.html
"""

from __future__ import annotations

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.messages import Message, dialect
from advise_ros.mavlink.parameter_values import decode

ASK_S, TRIES = 0.5, 6
# Tries for what not every version has.
OPTIONAL_TRIES = 2


class Readings:
    """Asks for parameters until they came or were asked for TRIES times.

    Args:
        names: what to ask for.
        bytewise: whole numbers travel as the bytes of the float that carries them (PX4).
        optional: those of the names that not every version has.

    Attributes:
        values: name -> value, as far as it came.
        kinds: name -> MAV_PARAM_TYPE, likewise.
    """

    def __init__(self, names: tuple[str, ...], *, bytewise: bool, optional: frozenset[str] = frozenset()) -> None:
        self._names, self._bytewise, self._optional = names, bytewise, optional
        self._asked: tuple[float, int] = (0.0, 0)
        self.values: dict[str, float] = {}
        self.kinds: dict[str, int] = {}

    @property
    def done(self) -> bool:
        """All came, or there is no more hope."""
        missing, times = set(self._names) - set(self.values), self._asked[1]
        return not missing or times > TRIES or (missing <= self._optional and times > OPTIONAL_TRIES)

    def step(self, target: tuple[int, int], now_s: float) -> list[Message]:
        """What to send now.

        Args:
            target: system and component id.
            now_s: steady time.
        """
        asked_s, times = self._asked
        if self.done or (times and now_s - asked_s < ASK_S):
            return []
        self._asked = now_s, times + 1
        missing = [name for name in self._names if name not in self.values]
        return [read_request(target, name) for name in missing]

    def observe(self, message: Message) -> None:
        """Take in a message of the autopilot."""
        if message.get_msgId() != mav.PARAM_VALUE or message.param_id not in self._names:
            return
        self.values[message.param_id] = decode(message, bytewise=self._bytewise)
        self.kinds[message.param_id] = int(message.param_type)


def read_request(target: tuple[int, int], name: str) -> Message:
    """PARAM_REQUEST_READ by name."""
    return dialect.MAVLink_param_request_read_message(*target, name.encode(), -1)
