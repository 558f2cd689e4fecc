"""Parameters written to an autopilot one after the other, each until it reads back.

https://mavlink.io/en/services/parameter.html#write
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.findings import Change
from advise_ros.mavlink.messages import Message, dialect
from advise_ros.mavlink.parameter_values import as_carried, decode, encode
from advise_ros.mavlink.readings import ASK_S, TRIES, read_request


class Writings:
    """Writes the changes in their order and stops at the first that does not read back.

    Args:
        changes: names and values.
        kinds: name -> MAV_PARAM_TYPE, as the autopilot said it; PX4 refuses another.
        bytewise: whole numbers travel as the bytes of the float that carries them (PX4).

    Attributes:
        written: the changes that read back, in order.
    """

    def __init__(self, changes: Sequence[Change], kinds: Mapping[str, int], *, bytewise: bool) -> None:
        self._changes, self._kinds, self._bytewise = tuple(changes), kinds, bytewise
        self._sent: tuple[float, int] = (0.0, 0)
        self._said: dict[str, float] = {}
        self.written: list[Change] = []

    @property
    def left(self) -> tuple[Change, ...]:
        """What has not read back so far."""
        return self._changes[len(self.written):]

    @property
    def unconfirmed(self) -> Change | None:
        """The change that was sent and has not read back so far."""
        return self.left[0] if self.left and self._sent[1] else None

    @property
    def done(self) -> bool:
        """All are written, or the next one was tried in vain."""
        return not self.left or self._sent[1] > TRIES

    @property
    def failure(self) -> str:
        """Why the next one was not written, '' if nothing is known."""
        if not self.left or not self.done:
            return ''
        change = self.left[0]
        if change.name in self._said:
            return f'{change.name} stays {self._said[change.name]:g}: the autopilot refuses {change.value:g}'
        return f'{change.name}: no answer to {TRIES} tries'

    def step(self, target: tuple[int, int], now_s: float) -> list[Message]:
        """What to send now.

        Args:
            target: system and component id.
            now_s: steady time.
        """
        sent_s, times = self._sent
        if self.done or (times and now_s - sent_s < ASK_S):
            return []
        self._sent = now_s, times + 1
        if times >= TRIES:
            return []
        change = self.left[0]
        kind = self._kinds[change.name]
        value = encode(change.value, kind, bytewise=self._bytewise)
        write = dialect.MAVLink_param_set_message(*target, change.name.encode(), value, kind)
        return [write, read_request(target, change.name)]

    def observe(self, message: Message) -> None:
        """Take in a message of the autopilot; what was on its way before the first try does not count."""
        if message.get_msgId() != mav.PARAM_VALUE or self.done or not self._sent[1]:
            return
        change = self.left[0]
        if message.param_id != change.name:
            return
        value = decode(message, bytewise=self._bytewise)
        self._said[change.name] = value
        if value == as_carried(change.value, self._kinds[change.name]):
            self.written.append(change)
            self._sent = (0.0, 0)
