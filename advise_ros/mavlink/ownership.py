"""Who owns the armed vehicle, and which failsafe of the autopilot controls it."""

from __future__ import annotations

import math
import re
from enum import Enum

from advise_ros.mavlink.vehicle import Vehicle

# A text within this time of a change of mode explains it; heartbeats come once a second.
EXPLAINS_S = 3.0
# What PX4 says of every failsafe; its reasons go as events, which need a dictionary of its very version.
BARE = re.compile(r'failsafe( mode)?( activated)?', re.IGNORECASE)


class Holder(Enum):
    """Owner of the armed vehicle. Only a take-off or a take-over that a person asks for makes it OURS."""

    NOBODY = 'nobody'
    OURS = 'ours'
    OTHERS = 'others'


class Ownership:
    """Who owns the vehicle, and why it is not ours.

    A bridge owns nothing that it did not take off or take over. What it has lost stays lost: a mode that comes
    back may be used by another pilot, or a failsafe that has ended over a vehicle on the ground.

    Attributes:
        holder: of the armed vehicle; NOBODY while it is disarmed.
        why: how it came to be others', in words.
    """

    def __init__(self) -> None:
        self.holder = Holder.NOBODY
        self.why = ''

    def claim(self) -> None:
        """It is ours: a person asked for it."""
        self.holder, self.why = Holder.OURS, ''

    def lose(self, why: str) -> None:
        """It is others', if it is not already."""
        if self.holder is not Holder.OTHERS:
            self.holder, self.why = Holder.OTHERS, why

    def rest(self) -> None:
        """It is disarmed."""
        self.holder, self.why = Holder.NOBODY, ''


class FailsafeWatch:
    """Names the failsafe that an armed vehicle is in.

    It shows in the state of the heartbeat, in a mode that is flown against the one that was commanded, and in a
    text about the change of mode.

    Attributes:
        name: the autopilot's text if it says more than that there is one, or the mode; '' when there is none.
    """

    def __init__(self) -> None:
        self.name = ''
        self._mode: int | None = None
        self._mode_s = -math.inf
        self._by_text = self._kept = ''
        self._explained_s = -math.inf

    def look(self, vehicle: Vehicle, mode: str, now_s: float, *, own: bool = False) -> None:
        """Take in the vehicle's present state.

        Args:
            vehicle: its facts.
            mode: name of its mode.
            now_s: steady time.
            own: whether that is the mode of our setpoints.
        """
        if vehicle.custom_mode != self._mode:
            self._mode, self._mode_s, self._by_text = vehicle.custom_mode, now_s, ''
        text_s = vehicle.failsafe_text_at_s
        if text_s != self._explained_s and abs(text_s - self._mode_s) <= EXPLAINS_S:  # Each text explains one change.
            self._by_text, self._explained_s = vehicle.failsafe_text, text_s
        if not vehicle.armed or not (vehicle.in_failsafe or self._by_text):
            self.name = self._kept = ''
        else:
            self._kept = _reason(self._by_text) or self._kept
            self.name = self._kept or (self.name if own else '') or mode


def _reason(text: str) -> str:
    """A text that gives a reason; '' for one that only says that a failsafe acts."""
    return '' if BARE.fullmatch(text.strip(' \t.:')) else text
