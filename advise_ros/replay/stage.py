"""What one stage of a replay compares, and the first difference between two messages in words."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.learning.learner import Learned
from advise_ros.recording.codec import Codec
from advise_ros.recording.definitions import definition
from advise_ros.replay.decisions import Decision, decision, first_change
from advise_ros.replay.session import RecordedMessage, RecordedSession
from advise_ros.ros.cdr import to_cdr

# Floats may differ by this much, relative to the greater of 1 and their size, where decisions are asked for.
TOLERANCE = 1e-6


class Difference(NamedTuple):
    """One field that differs.

    Attributes:
        field: path in the message, e.g. 'grid.info.width' or 'greedy[3]'.
        expected: the rebuilt value as text.
        got: the recorded value as text.
    """

    field: str
    expected: str
    got: str


def first_difference(expected: Any, got: Any, *, exact: bool, path: str = '', without: tuple[str, ...] = ()) -> Difference | None:
    """Where two messages differ first, in the order of their fields; those that `got` does not have are passed over.

    Args:
        expected, got: decoded messages, or parts of them, of one type.
        exact: floats must be equal in every bit; else within TOLERANCE.
        path: of the parts.
        without: names of fields on the first level that do not count.
    """
    names = _fields(expected)
    if names:
        for name in names:
            if name in without or not hasattr(got, name):  # A bag of another version; see RecordedSession.missing.
                continue
            found = first_difference(
                getattr(expected, name), getattr(got, name), exact=exact, path=f'{path}.{name}' if path else name,
            )
            if found:
                return found
        return None
    if isinstance(expected, (list, tuple, np.ndarray)):
        return _in_sequence(expected, got, exact, path)
    return None if _same(expected, got, exact) else Difference(path, _text(expected), _text(got))


def _fields(value: Any) -> tuple[str, ...]:
    names = getattr(value, '__dataclass_fields__', {})
    return tuple(name for name in names if name != '__msgtype__')


def _in_sequence(expected: Any, got: Any, exact: bool, path: str) -> Difference | None:
    if got is None or len(expected) != len(got):
        return Difference(path, f'{len(expected)} entries', 'nothing' if got is None else f'{len(got)} entries')
    for index, (one, other) in enumerate(zip(expected, got, strict=True)):
        found = first_difference(one, other, exact=exact, path=f'{path}[{index}]')
        if found:
            return found
    return None


def _same(expected: Any, got: Any, exact: bool) -> bool:
    if not isinstance(expected, (float, np.floating)) or not isinstance(got, (float, np.floating)):
        return bool(expected == got)
    one, other = float(expected), float(got)
    if math.isnan(one) or math.isnan(other):
        return math.isnan(one) and math.isnan(other)
    if exact:
        return one == other and math.copysign(1.0, one) == math.copysign(1.0, other)
    return abs(one - other) <= TOLERANCE * max(1.0, abs(one), abs(other))


def _text(value: Any) -> str:
    if value is None:
        return 'nothing'
    return repr(value.item() if isinstance(value, np.generic) else value)


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
