"""MAVLink's mission protocol from the ground station's side: clear, send, read back and compare.

https://mavlink.io/en/services/mission.html. Both autopilots keep half of an upload that was given up, and may accept the next
one with it, so nothing counts but what is read back.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum
from typing import NamedTuple

from advise_ros.mavlink.messages import Message, dialect

MISSION = int(dialect.MAV_MISSION_TYPE_MISSION)
ACCEPTED = int(dialect.MAV_MISSION_ACCEPTED)
# The same frame with whole and with broken numbers.
SAME_FRAMES = {
    int(dialect.MAV_FRAME_GLOBAL_INT): int(dialect.MAV_FRAME_GLOBAL),
    int(dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT): int(dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT),
    int(dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT): int(dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT),
}
# A message that gets no reply is sent again so many times.
RETRY_S, TRIES = 1.5, 6
# Parameters of an item: how long to stay, how near, yaw.
NOTHING = (0.0, 0.0, 0.0, 0.0)
# ArduPilot keeps heights in centimetres, and degrees as both send them.
HEIGHT_M, PLACE_E7 = 0.011, 1


class WireItem(NamedTuple):
    """An item as it travels: latitude and longitude in 1e-7 degrees."""

    frame: int
    command: int
    x: int
    y: int
    z: float

    def is_as(self, other: WireItem) -> bool:
        """Whether a vehicle that was sent the other may keep it as this."""
        return (
            SAME_FRAMES.get(self.frame, self.frame) == SAME_FRAMES.get(other.frame, other.frame) and self.command == other.command
            and abs(self.x - other.x) <= PLACE_E7 and abs(self.y - other.y) <= PLACE_E7 and abs(self.z - other.z) <= HEIGHT_M
        )


class Phase(Enum):
    """What is waited for."""

    CLEAR = 'the clearing of its mission'
    SEND = 'its requests for items'
    COUNT = 'the number of its items'
    READ = 'its items'
    DONE = 'nothing'
    FAILED = 'nothing more'


class MissionTransfer:
    """One upload to one vehicle. Feed it with `observe`, move it with `step`, which gives the messages to send.

    Args:
        target: system and component.
        own: ours; what the vehicle says to another ground station on the same link is none of this upload's.
        items: the mission.
        own_first: the vehicle keeps an item of its own, home, at number 0 (ArduPilot): what is read back there is not compared.

    Attributes:
        failure: why it was not taken, or not as it was sent.
        sent: the highest number of an item that the vehicle asked for, plus 1.
    """

    def __init__(self, target: tuple[int, int], own: tuple[int, int], items: Sequence[WireItem], *, own_first: bool) -> None:
        self._target, self._own, self._items, self._own_first = target, own, tuple(items), own_first
        self.phase, self.failure, self.sent = Phase.CLEAR, '', 0
        self._read: list[WireItem] = []
        self._accepted_early = False
        self._tries, self._due_s = 0, 0.0
        self._out: list[Message] = []
        self._handlers: dict[str, Callable[[Message], None]] = {
            'MISSION_ACK': self._on_ack, 'MISSION_REQUEST_INT': self._on_request, 'MISSION_REQUEST': self._on_request,
            'MISSION_COUNT': self._on_count, 'MISSION_ITEM_INT': self._on_item,
        }

    @property
    def over(self) -> bool:
        return self.phase in (Phase.DONE, Phase.FAILED)

    def observe(self, message: Message) -> None:
        """A message of the vehicle."""
        handler = self._handlers.get(message.get_type())
        if handler is None or self.over or getattr(message, 'mission_type', MISSION) != MISSION:
            return
        if (message.get_srcSystem(), message.get_srcComponent()) == self._target and self._is_ours(message):
            handler(message)

    def _is_ours(self, message: Message) -> bool:
        """Whether it is for us; 0 is everybody."""
        return all(to in (0, own) for to, own in zip((message.target_system, message.target_component), self._own, strict=True))

    def step(self, now_s: float) -> list[Message]:
        """Messages that are due at a time of the steady clock."""
        out, self._out = self._out, []
        if out:  # The vehicle replied: what it does next has its own time.
            self._tries, self._due_s = 1, now_s + RETRY_S
            return out
        if self.over or now_s < self._due_s:
            return []
        if self._tries == TRIES:
            self._fail(f'{self.phase.value} did not come, asked {TRIES} times; nearer, or on a better link, try again')
            return []
        self._tries, self._due_s = self._tries + 1, now_s + RETRY_S
        return [self._asking()]

    def _asking(self) -> Message:
        """What is said again until there is a reply."""
        if self.phase is Phase.CLEAR:
            return dialect.MAVLink_mission_clear_all_message(*self._target, MISSION)
        if self.phase is Phase.SEND and self._accepted_early:
            self._enter(Phase.COUNT)
        if self.phase is Phase.SEND:  # The last item again, if one was sent: it, or the next request, was lost.
            return self._item(self.sent - 1) if self.sent else self._count()
        if self.phase is Phase.COUNT:
            return dialect.MAVLink_mission_request_list_message(*self._target, MISSION)
        return dialect.MAVLink_mission_request_int_message(*self._target, len(self._read), MISSION)

    def _enter(self, phase: Phase) -> None:
        self.phase, self._tries, self._due_s = phase, 0, 0.0

    def _fail(self, why: str) -> None:
        self.failure = why
        self._enter(Phase.FAILED)

    def _count(self) -> Message:
        return dialect.MAVLink_mission_count_message(*self._target, len(self._items), MISSION)

    def _item(self, number: int) -> Message:
        item = self._items[number]
        return dialect.MAVLink_mission_item_int_message(
            *self._target, number, item.frame, item.command, int(number == 0), 1, *NOTHING, item.x, item.y, item.z, MISSION,
        )

    # -- replies -------------------------------------------------------------------------------
    def _on_ack(self, message: Message) -> None:
        if self.phase is Phase.CLEAR:
            if message.type == ACCEPTED:
                self._enter(Phase.SEND)
            else:
                self._fail(f'it does not clear its mission ({_result(message.type)})')
        elif self.phase is Phase.SEND:
            if message.type != ACCEPTED:
                self._fail(f'it refuses item {self.sent} of {len(self._items)} ({_result(message.type)}); do not fly its mission')
            elif self.sent == len(self._items):
                self._enter(Phase.COUNT)
            else:  # That of the clearing, late; or it counts less items than were sent, and asks for no more.
                self._accepted_early = self.sent > 0

    def _on_request(self, message: Message) -> None:
        if self.phase is not Phase.SEND:
            return
        if not 0 <= message.seq < len(self._items):
            self._fail(f'it asks for item {message.seq} of {len(self._items)}: an earlier upload is in its way; try again')
            return
        self.sent, self._accepted_early = max(self.sent, message.seq + 1), False
        self._out.append(self._item(message.seq))

    def _on_count(self, message: Message) -> None:
        if self.phase is not Phase.COUNT:
            return
        if message.count != len(self._items):
            self._fail(f'it says that it has {message.count} items, not the {len(self._items)} that were sent; try again')
            return
        self._enter(Phase.READ)

    def _on_item(self, message: Message) -> None:
        if self.phase is not Phase.READ or message.seq != len(self._read):
            return
        item = WireItem(message.frame, message.command, message.x, message.y, message.z)
        if not (item.is_as(self._items[message.seq]) or (self._own_first and message.seq == 0)):
            self._fail(f'its item {message.seq} is {item}, not {self._items[message.seq]} as it was sent; do not fly it')
            return
        self._read.append(item)
        if len(self._read) == len(self._items):
            self._out.append(dialect.MAVLink_mission_ack_message(*self._target, ACCEPTED, MISSION))
            self.phase = Phase.DONE
        else:
            self._tries, self._due_s = 0, 0.0


def _result(number: int) -> str:
    known = dialect.enums['MAV_MISSION_RESULT'].get(number)
    return str(known.name).removeprefix('MAV_MISSION_').lower() if known else f'result {number}'
