"""What is asked of a vehicle, how it went, and the commands that are repeated until their effect is seen."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.vehicle import Vehicle

RETRY_S = 1.0
TRIES = 5
# A command that is said to be in progress is not repeated; its end is waited for this long.
IN_PROGRESS_S = 20.0
# A refusal's text may follow its ACK.
TEXT_WAIT_S = 0.3
# A text this long before the ACK still explains it.
TEXT_BEFORE_S = 0.5


class Goal(Enum):
    """What a person or a node may ask."""

    ARM = 'arm'
    DISARM = 'disarm'
    TAKEOFF = 'take-off'
    LAND = 'landing'
    TAKE_OVER = 'take-over'


class GoalReply(NamedTuple):
    """Whether the vehicle does what was asked, in words."""

    accepted: bool
    message: str


@dataclass
class GoalRequest:
    """One asked goal; `reply` is set once it is clear whether the vehicle begins."""

    goal: Goal
    begun_s: float
    altitude_m: float = 0.0
    reply: GoalReply | None = None

    def answer(self, accepted: bool, message: str) -> None:
        """Set the reply, once."""
        if self.reply is None:
            self.reply = GoalReply(accepted, message)


class Progress(Enum):
    """How a repeated command stands."""

    WAITING = 0
    ACCEPTED = 1
    REFUSED = 2
    SILENT = 3


class Repeated:
    """One command, sent every RETRY_S until the caller sees its effect, TRIES times at most."""

    def __init__(self, message: Message) -> None:
        self._message = message
        self._first_s = math.inf
        self._sent_s = -math.inf
        self._tries = 0
        self._accepted = False
        self._in_progress = False

    def due(self, now_s: float) -> list[Message]:
        """The command if it is time to send it.

        Args:
            now_s: steady time.
        """
        if self._accepted or self._in_progress or self._tries >= TRIES or now_s - self._sent_s < RETRY_S:
            return []
        self._first_s = min(self._first_s, now_s)
        self._sent_s = now_s
        self._tries += 1
        return [self._message]

    def progress(self, vehicle: Vehicle, now_s: float) -> Progress:
        """How the autopilot answered; a refusal is reported after its text had time to come.

        Args:
            vehicle: with the acknowledgements that came.
            now_s: steady time.
        """
        result = vehicle.ack_since(int(self._message.command), self._first_s)
        self._accepted = self._accepted or result == mav.ACK_ACCEPTED
        self._in_progress = result == mav.ACK_IN_PROGRESS and now_s - self._sent_s < IN_PROGRESS_S
        if self._accepted:  # Whatever a repetition was answered.
            return Progress.ACCEPTED
        if self._in_progress:
            return Progress.WAITING
        if result is not None and result not in (mav.ACK_IN_PROGRESS, mav.ACK_TEMPORARILY_REJECTED):
            return Progress.REFUSED if now_s - self._sent_s >= TEXT_WAIT_S else Progress.WAITING
        if self._tries >= TRIES and now_s - self._sent_s >= RETRY_S:
            return Progress.SILENT if result is None else Progress.REFUSED
        return Progress.WAITING

    def why(self, vehicle: Vehicle) -> str:
        """The refusal in words, with the autopilot's own text if there is one."""
        result = vehicle.ack_since(int(self._message.command), self._first_s)
        if result is None:
            return f'no answer to {self._tries} commands'
        said = f'the autopilot says: {vehicle.text}' if vehicle.text_at_s >= self._first_s - TEXT_BEFORE_S else 'no reason given'
        return f'{mav.ACK_NAMES.get(result, f"result {result}")}; {said}'
