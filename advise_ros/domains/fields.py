"""Arrays of an .npz file, each checked as it is read: errors name the field."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import BadZipFile

import numpy as np

from advise_ros.core.errors import InputError
from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.planning.process import Mdp, Transitions, from_transitions

TRANSITIONS = ('p_action', 'p_from', 'p_to', 'p_prob')
PROCESS = ('n_states', 'n_actions', 'gamma', *TRANSITIONS)
MOST_STATES = 10_000_000
MOST_ACTIONS = 256


class Fields(NamedTuple):
    """The fields of one file; every reader raises InputError with the field's name, its value and what is allowed."""

    path: str
    arrays: dict[str, np.ndarray[Any, Any]]

    def __contains__(self, name: object) -> bool:
        return name in self.arrays

    def wrong(self, name: str, reason: str) -> InputError:
        """The error about a field."""
        return InputError(f"{self.path}: field '{name}' {reason}")

    def check_names(self, known: Collection[str]) -> None:
        """Refuse unknown fields, most often a misspelling.

        Raises:
            InputError: one of them is unknown; names the known ones.
        """
        for name in sorted(set(self.arrays) - set(known)):
            raise self.wrong(name, f'is unknown; known are {", ".join(known)}')

    def array(self, name: str, dimensions: int, kinds: str) -> np.ndarray[Any, Any]:
        """A field with this number of dimensions, of one of numpy's kinds of type.

        Raises:
            InputError: it is missing, or has another shape or type.
        """
        if name not in self.arrays:
            raise self.wrong(name, 'is missing')
        found = self.arrays[name]
        if found.ndim != dimensions:
            needed = f'{dimensions} dimension{"s" * (dimensions != 1)}' if dimensions else 'to be a single value'
            raise self.wrong(name, f'has shape {found.shape}; it needs {needed}')
        if found.dtype.kind not in kinds and found.size:
            wanted = {'iu': 'whole numbers', 'iuf': 'numbers', 'biu': 'true or false', 'U': 'text'}[kinds]
            raise self.wrong(name, f'holds {found.dtype}; it needs {wanted}')
        return found

    def number(self, name: str, least: float, most: float, default: float | None = None) -> float:
        """A number within its bounds, both included.

        Args:
            name: of the field.
            least, most: bounds.
            default: if the field is missing; None: it must be there.

        Raises:
            InputError: it is missing, no number or out of bounds.
        """
        if default is not None and name not in self.arrays:
            return default
        value = float(self.array(name, 0, 'iuf'))
        if not least <= value <= most:
            raise self.wrong(name, f'is {value:g}; allowed is {least:g} to {most:g}')
        return value

    def whole(self, name: str, least: int, most: int) -> int:
        """A whole number within its bounds, both included.

        Raises:
            InputError: it is missing, no whole number or out of bounds.
        """
        value = int(self.array(name, 0, 'iu'))
        if not least <= value <= most:
            raise self.wrong(name, f'is {value}; allowed is {least} to {most}')
        return value

    def text(self, name: str, allowed: Collection[str], default: str) -> str:
        """One of some words.

        Raises:
            InputError: it is missing or none of them.
        """
        value = str(self.array(name, 0, 'U')) if name in self.arrays else default
        if value not in allowed:
            raise self.wrong(name, f"is '{value}'; allowed is {', '.join(allowed)}")
        return value

    def indices(self, name: str, end: int) -> Ints:
        """(k,) whole numbers from 0 to below `end`.

        Raises:
            InputError: it is missing, or one is out of range.
        """
        found = self.array(name, 1, 'iu')
        if len(found) and not 0 <= found.min() <= found.max() < end:
            bad = found[(found < 0) | (found >= end)][0]
            raise self.wrong(name, f'holds {bad}; allowed is 0 to {end - 1}')
        return found.astype(np.int64)

    def floats(self, name: str) -> Floats:
        """(k,) finite numbers.

        Raises:
            InputError: it is missing, or one is not finite.
        """
        found = self.array(name, 1, 'iuf').astype(np.float64)
        if not np.isfinite(found).all():
            raise self.wrong(name, f'holds {found[~np.isfinite(found)][0]}; it needs finite numbers')
        return found

    def flags(self, name: str, shape: tuple[int, ...]) -> Bools:
        """Booleans of a shape; 0 and 1 do too.

        Raises:
            InputError: it is missing, has another shape, or holds other numbers.
        """
        found = self.array(name, len(shape), 'biu')
        if found.shape != shape:
            raise self.wrong(name, f'has shape {found.shape}; it needs {shape}')
        if not np.isin(found, (0, 1)).all():
            raise self.wrong(name, 'holds numbers beside 0 and 1; it needs true or false')
        return found.astype(np.bool_)

    def same_length(self, names: tuple[str, ...]) -> None:
        """Refuse fields of different lengths whose entries belong together.

        Raises:
            InputError: two differ; names both.
        """
        for name in names[1:]:
            if len(self.arrays[name]) != len(self.arrays[names[0]]):
                raise self.wrong(
                    name, f"has {len(self.arrays[name])} entries and '{names[0]}' has {len(self.arrays[names[0]])}"
                )


def read_fields(path: str | Path) -> Fields:
    """All arrays of an .npz file.

    Raises:
        InputError: it cannot be read, or a field holds Python objects.
    """
    try:
        loaded = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError, BadZipFile) as problem:
        reason = getattr(problem, 'strerror', None) or 'it is no .npz file'
        raise InputError(f'{path} cannot be read: {reason}') from problem
    if not isinstance(loaded, np.lib.npyio.NpzFile):
        raise InputError(f'{path} cannot be read: it holds one array; write it with numpy.savez')
    fields = Fields(str(path), {})
    with loaded:
        for name in loaded.files:
            try:
                fields.arrays[name] = loaded[name]
            except (OSError, ValueError, EOFError, BadZipFile) as problem:
                reason = 'holds Python objects; save numbers, true and false, or text' if 'pickle' in str(problem) else \
                    f'cannot be read: {problem}'
                raise fields.wrong(name, reason) from problem
    return fields


def read_process(fields: Fields) -> Mdp:
    """The decision process of a file.

    Raises:
        InputError: a field is missing or wrong.
    """
    n_states, n_actions = fields.whole('n_states', 1, MOST_STATES), fields.whole('n_actions', 2, MOST_ACTIONS)
    gamma = fields.number('gamma', 0.0, 1.0)
    if gamma == 1.0:
        raise fields.wrong('gamma', 'is 1; values need a discount below 1')
    transitions = Transitions(
        fields.indices('p_action', n_actions), fields.indices('p_from', n_states), fields.indices('p_to', n_states),
        fields.floats('p_prob'),
    )
    fields.same_length(TRANSITIONS)
    try:
        return from_transitions(n_states, n_actions, gamma, transitions)
    except InputError as problem:
        raise fields.wrong('p_prob', f'is no process: {problem}') from problem
