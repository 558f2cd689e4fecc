"""The first difference between two messages, in words."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

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
