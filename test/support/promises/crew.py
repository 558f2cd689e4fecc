"""Runs parts of the promises as processes side by side, and ends them when their time is over."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from support.promises.parts import Part

POLL_S = 0.5
# Longest time to end a flight and its nodes.
GRACE_S = 60.0


@dataclass
class Crew:
    """At most `jobs` parts at a time, and one more of those that give way.

    Attributes:
        command_of: the command that runs a part.
        until_s: steady time at which whatever still runs is ended.
        on_end: is told the name of a part that ended, its exit code and its seconds.
    """

    command_of: Callable[[str], list[str]]
    jobs: int
    until_s: float
    on_end: Callable[[str, int, float], None]
    _running: dict[str, tuple[subprocess.Popen[bytes], float]] = field(default_factory=dict)

    def run(self, parts: Mapping[str, Part]) -> None:
        """Until all have ended; ends them all when it is interrupted."""
        waiting = dict(parts)
        try:
            while (waiting or self._running) and time.monotonic() < self.until_s:
                self._begin(parts, waiting)
                time.sleep(POLL_S)
                self._collect()
        finally:
            self._end_all()

    def _begin(self, parts: Mapping[str, Part], waiting: dict[str, Part]) -> None:
        for name, part in list(waiting.items()):
            alike = sum(parts[other].background == part.background for other in self._running)
            if alike < (1 if part.background else self.jobs) and len(self._running) < self.jobs + 1:
                del waiting[name]
                command = self.command_of(name)
                nice = ['nice', '-n', str(part.niceness)] if part.niceness else []
                self._running[name] = subprocess.Popen([*nice, *command]), time.monotonic()

    def _collect(self) -> None:
        for name, (process, began_s) in list(self._running.items()):
            if process.poll() is not None:
                del self._running[name]
                self.on_end(name, process.returncode, time.monotonic() - began_s)

    def _end_all(self) -> None:
        for process, _ in self._running.values():
            process.send_signal(signal.SIGTERM)
        end_s = time.monotonic() + GRACE_S
        while self._running and time.monotonic() < end_s:
            time.sleep(POLL_S)
            self._collect()
        for process, _ in self._running.values():
            process.kill()
