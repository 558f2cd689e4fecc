"""The mission that an autopilot keeps, with the manners of ArduPilot and PX4 as measured on them.

Neither is transactional: what an upload that is given up has changed stays changed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from advise_ros.mavlink.messages import Message, dialect
from advise_ros.mavlink.mission_transfer import ACCEPTED, MISSION, SAME_FRAMES, WireItem

ERROR, DENIED = int(dialect.MAV_MISSION_ERROR), int(dialect.MAV_MISSION_DENIED)
UNSUPPORTED_FRAME, NO_SPACE = int(dialect.MAV_MISSION_UNSUPPORTED_FRAME), int(dialect.MAV_MISSION_NO_SPACE)
WHOLE_FRAMES = {broken: whole for whole, broken in SAME_FRAMES.items()}
MOST_ITEMS = 650
Answers = list[Message]


@dataclass
class MissionManners:
    """What differs between the two.

    Attributes:
        keeps_home: item 0 is home, whatever was sent.
        kept_frames: which of two equal frames items come back in.
        height_m: steps in which heights are kept; 0: single precision.
        patience_s: an upload that does not go on is given up after this.
        count_stays: an upload that was given up after its count leaves that count for the next one.
    """

    keeps_home: bool
    kept_frames: dict[int, int]
    height_m: float
    patience_s: float
    count_stays: bool


ARDUPILOT = MissionManners(True, SAME_FRAMES, 0.01, 8.0, False)
PX4 = MissionManners(False, WHOLE_FRAMES, 0.0, 5.0, True)


@dataclass
class MissionStore:
    """The mission of a simulated autopilot, and the upload or download that goes on.

    Args:
        manners: of the autopilot.
        home: of item 0, in 1e-7 degrees.
        now_s: the autopilot's clock.
    """

    manners: MissionManners
    home: tuple[int, int]
    now_s: Callable[[], float]
    items: list[WireItem] = field(default_factory=list)
    _uploader: tuple[int, int] | None = None
    _count: int = 0
    _next: int = 0
    _at_s: float = 0.0

    def handlers(self) -> dict[str, Callable[[Message], Answers]]:
        """Message -> what answers it."""
        return {
            'MISSION_CLEAR_ALL': self._on_clear, 'MISSION_COUNT': self._on_count, 'MISSION_ITEM_INT': self._on_item,
            'MISSION_REQUEST_LIST': self._on_list, 'MISSION_REQUEST_INT': self._on_request, 'MISSION_ACK': lambda _: [],
        }

    def _on_clear(self, message: Message) -> Answers:
        self.items.clear()
        if not self.manners.count_stays:
            self._uploader = None
        return [_ack(message, ACCEPTED)]

    def _on_count(self, message: Message) -> Answers:
        sender = message.get_srcSystem(), message.get_srcComponent()
        given_up = self.now_s() - self._at_s > self.manners.patience_s
        if self._uploader not in (None, sender) and not given_up:
            return [_ack(message, DENIED)]
        if message.count > MOST_ITEMS:
            return [_ack(message, NO_SPACE)]
        again = self._uploader == sender and not given_up and self._next == 0
        if not (self.manners.count_stays and self._uploader is not None and given_up):
            self._count = message.count
        self._uploader, self._at_s = sender, self.now_s()
        self._next = self._next if again else 0
        return [self._asking(message)]

    def _on_item(self, message: Message) -> Answers:
        sender = message.get_srcSystem(), message.get_srcComponent()
        if self._uploader != sender:
            return [_ack(message, ERROR)] if self._uploader is None else []
        self._at_s = self.now_s()
        if message.seq != self._next:  # Late, or twice: the one that is wanted is asked for again.
            return [self._asking(message)]
        if message.frame not in SAME_FRAMES and message.frame not in SAME_FRAMES.values():
            self._uploader = None
            return [_ack(message, UNSUPPORTED_FRAME)]
        self._keep(message)
        self._next += 1
        if self._next < self._count:
            return [self._asking(message)]
        self._uploader = None
        del self.items[self._count :]
        return [_ack(message, ACCEPTED)]

    def _keep(self, message: Message) -> None:
        """In its place at once, where the others are still those of before."""
        manners, step_m = self.manners, self.manners.height_m
        height_m = round(message.z / step_m) * step_m if step_m else message.z
        item = WireItem(manners.kept_frames.get(message.frame, message.frame), message.command, message.x, message.y, height_m)
        if manners.keeps_home and message.seq == 0:
            item = WireItem(int(dialect.MAV_FRAME_GLOBAL), int(dialect.MAV_CMD_NAV_WAYPOINT), *self.home, 0.0)
        self.items[message.seq : message.seq + 1] = [item]

    def _on_list(self, message: Message) -> Answers:
        to = message.get_srcSystem(), message.get_srcComponent()
        return [dialect.MAVLink_mission_count_message(*to, len(self.items), MISSION)]

    def _on_request(self, message: Message) -> Answers:
        if not 0 <= message.seq < len(self.items):
            return [_ack(message, ERROR)]
        item = self.items[message.seq]
        return [dialect.MAVLink_mission_item_int_message(
            message.get_srcSystem(), message.get_srcComponent(), message.seq, item.frame, item.command, 0, 1,
            0.0, 0.0, 0.0, 0.0, item.x, item.y, item.z, MISSION,
        )]

    def _asking(self, message: Message) -> Message:
        return dialect.MAVLink_mission_request_int_message(
            message.get_srcSystem(), message.get_srcComponent(), self._next, MISSION,
        )


def _ack(message: Message, result: int) -> Message:
    return dialect.MAVLink_mission_ack_message(message.get_srcSystem(), message.get_srcComponent(), result, MISSION)
