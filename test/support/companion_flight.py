"""A companion and a scripted copter in simulated time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from advise_ros.mavlink.companion import Companion, Settings
from advise_ros.mavlink.framing import Framer
from advise_ros.mavlink.messages import dialect
from advise_ros.mavlink.requests import Goal, GoalRequest
from support.scripted import ScriptedCopter

DT_S = 0.05


class Flight:
    """A companion and a copter that hear each other, and their common time."""

    def __init__(self, copter: ScriptedCopter, **settings: Any) -> None:
        self.copter = copter
        self.companion = Companion(Settings(**settings))
        self.now_s = 100.0
        self.cut = False
        self.sent: list[Any] = []
        self._codec = dialect.MAVLink(None, copter.system_id, 1)
        self._framer = Framer()

    def deliver(self, messages: list[Any], codec: Any = None) -> None:
        """Let the companion hear messages, by default from the copter."""
        for message in messages:
            frame = bytes(message.pack(codec or self._codec))
            for decoded in self._framer.datagram(frame):
                self.companion.observe(decoded, self.now_s)

    def tick(self) -> None:
        self.now_s += DT_S
        ours = self.companion.step(self.now_s)
        self.sent += ours
        theirs = self.copter.step(DT_S)
        if not self.cut:
            theirs = [answer for message in ours for answer in self.copter.receive(message)] + theirs
            self.deliver(theirs)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / DT_S)):
            self.tick()

    def until(self, condition: Callable[[], bool], limit_s: float = 60.0) -> None:
        end_s = self.now_s + limit_s
        while not condition():
            assert self.now_s < end_s, self.status
            self.tick()

    def ask(self, goal: Goal, altitude_m: float = 3.0) -> GoalRequest:
        return self.companion.ask(goal, self.now_s, altitude_m)

    @property
    def status(self) -> Any:
        return self.companion.status(self.now_s)

    def fly(self) -> None:
        """To the take-off altitude."""
        self.until(lambda: self.status.ready)
        self.ask(Goal.TAKEOFF)
        self.until(lambda: self.status.commandable)
