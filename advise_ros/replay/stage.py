"""What one stage of a replay found."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.learning.learner import Learned
from advise_ros.recording.codec import Codec
from advise_ros.recording.definitions import definition
from advise_ros.replay.compare import Difference, first_difference
from advise_ros.replay.decisions import Decision, decision, first_change
from advise_ros.replay.session import RecordedMessage, RecordedSession
from advise_ros.ros.cdr import to_cdr


@dataclass
class Stage:
    """Counts of one stage and its first difference in words.

    Attributes:
        name: what was rebuilt.
        checked: how many values were compared.
        equal: how many of them were equal.
        in_bytes: how many of those in every byte, whatever was asked.
        difference: the first that was not: topic, time, field, expected, got; '' when all were.
        notes: what was not rebuilt and why, one sentence each.
    """

    name: str
    checked: int = 0
    equal: int = 0
    in_bytes: int = 0
    difference: str = ''
    notes: list[str] = field(default_factory=list)

    @property
    def agrees(self) -> bool:
        return self.checked == self.equal

    @property
    def agrees_in_bytes(self) -> bool:
        return 0 < self.checked == self.in_bytes

    def count(self, difference: str, *, in_bytes: bool = False) -> None:
        """Count one comparison; '' means equal."""
        self.checked += 1
        self.equal += not difference
        self.in_bytes += in_bytes
        self.difference = self.difference or difference


@dataclass
class Rebuilt:
    """What was rebuilt, for the stages that follow, and what it decided.

    Attributes:
        demonstrations: in the order of the bag's; None for those that could not be rebuilt.
        policies: by the place of the bag's policy on its topic.
        decisions, recorded: stage -> what was rebuilt and what the bag holds, in pairs.
    """

    demonstrations: list[Demonstration | None] = field(default_factory=list)
    policies: dict[int, Learned] = field(default_factory=dict)
    decisions: dict[str, list[Decision]] = field(default_factory=dict)
    recorded: dict[str, list[Decision]] = field(default_factory=dict)


class Comparison:
    """Compares rebuilt messages with recorded ones.

    Byte for byte, or decisions with a tolerance on floats, or, where a parameter was changed, decisions alone.
    """

    def __init__(self, session: RecordedSession) -> None:
        self._session = session
        self._installed = Codec()
        self.exact = session.same_platform
        self.what_if = bool(session.overrides)
        self.rebuilt = Rebuilt()

    def count(self, stage: Stage, rebuilt: Any, recorded: RecordedMessage) -> None:
        """Compare a rebuilt message with the recorded one.

        Both sides are brought to the same bytes first: serialisers may leave anything in the padding.
        """
        type_name = recorded.message.type_name
        expected = self._through_cdr(rebuilt, type_name)
        change = self.decide(decision(expected, type_name), decision(recorded.value, type_name), stage.name)
        if self.what_if:
            stage.count(f'{recorded.where}: {change}' if change else '')
        elif self._same_bytes(expected, recorded):
            stage.count('', in_bytes=True)
        else:
            stage.count(self._difference(expected, recorded))

    def same(self, rebuilt: Any, recorded: RecordedMessage) -> bool:
        """Whether two messages are equal in every byte."""
        return self._same_bytes(self._through_cdr(rebuilt, recorded.message.type_name), recorded)

    def _difference(self, expected: Any, recorded: RecordedMessage) -> str:
        without = () if self._session.same_cores else ('digest',)
        found = first_difference(expected, recorded.value, exact=self.exact, without=without)
        return in_words(recorded, found) if found else ''

    def decide(self, rebuilt: Decision, recorded: Decision, stage: str) -> str:
        """Note both, and say in words what changed."""
        self.rebuilt.decisions.setdefault(stage, []).append(rebuilt)
        self.rebuilt.recorded.setdefault(stage, []).append(recorded)
        return first_change(rebuilt, recorded)

    def _same_bytes(self, expected: Any, recorded: RecordedMessage) -> bool:
        type_name = recorded.message.type_name
        wanted = self._installed.canonical(expected, type_name)
        return wanted == self._session.bag.codec.canonical(recorded.value, type_name)

    def _through_cdr(self, rebuilt: Any, type_name: str) -> Any:
        """The message as it would have travelled: floats rounded to their width."""
        if not self._installed.knows(type_name):
            self._installed.learn(type_name, 'ros2msg', definition(type_name).text)
        return self._installed.decode(to_cdr(rebuilt), type_name)


def in_words(recorded: RecordedMessage, found: Difference) -> str:
    """Topic, time, field, expected, got."""
    return f'{recorded.where}: {found.field} is {found.got}, expected {found.expected}'
