"""Which nodes receive a topic, by the counts in their /diagnostics.

What is sent before a reader has matched is lost on it, on reliable topics too, and two readers of a topic may match
seconds apart on a busy machine. A matched writer knows its own side only; that a reader counts messages is evidence.
"""

from __future__ import annotations

from collections.abc import Collection

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus


def counted(status: DiagnosticStatus, topic: str) -> int:
    """Messages of a topic, by its full name, that a node says it has had; 0 when it says nothing of it."""
    said = next((pair.value for pair in status.values if pair.key == topic), '')
    return int(said) if said.isdecimal() else 0


class Receivers:
    """Nodes that must receive what we send on a topic: each has to count messages that came after our first one.

    Attributes:
        missing: full names of those that have not.
    """

    def __init__(self, nodes: Collection[str], topic: str) -> None:
        """Both by their full names."""
        self.missing = set(nodes)
        self._topic = topic
        self._sending = False
        self._before: dict[str, int] = {}

    def sent(self) -> None:
        """A message of ours went out."""
        self._sending = True

    def on_diagnostics(self, array: DiagnosticArray) -> None:
        """What nodes counted before we sent anything came from others."""
        for status in array.status:
            if status.name not in self.missing:
                continue
            count = counted(status, self._topic)
            if not self._sending:
                self._before[status.name] = count
            elif count > self._before.setdefault(status.name, count):
                self.missing.discard(status.name)
