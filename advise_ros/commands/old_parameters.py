"""The file that keeps what parameters were before they were changed, so that they can be put back."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from advise_ros.core.errors import InputError
from advise_ros.mavlink.findings import Change

WANTED = '--undo wants the file that --apply named'


class ParameterChange(NamedTuple):
    """A parameter before and after a change."""

    name: str
    old: float
    new: float


class OldParameters(NamedTuple):
    """What was changed on one autopilot, in the order of writing."""

    autopilot: str
    system: int
    kept: tuple[ParameterChange, ...]

    def changes_back(self) -> list[Change]:
        """What puts it back, last first."""
        return [Change(kept.name, kept.old, 'as it was') for kept in reversed(self.kept)]


def save(path: Path, old: OldParameters, changes: Sequence[Change]) -> None:
    """Write the file, and have it on the disk before anything is changed.

    Raises:
        InputError: there is such a file, or it cannot be written.
    """
    why = {change.name: change.why for change in changes}
    content = {
        'autopilot': old.autopilot, 'system': old.system,
        'parameters': [{**kept._asdict(), 'why': why[kept.name]} for kept in old.kept],
    }
    try:
        with path.open('x', encoding='utf-8') as file:
            json.dump(content, file, indent=2)
            file.write('\n')
            file.flush()
            os.fsync(file.fileno())
    except FileExistsError:
        raise InputError(f'{path} exists and may hold old values that you need; name another file by --save') from None
    except OSError as problem:
        raise InputError(f'the old values cannot be saved to {path}: {problem.strerror}; nothing is written; '
                         'name another file by --save') from problem


def load(path: Path) -> OldParameters:
    """Read the file.

    Raises:
        InputError: it cannot be read, or is no such file.
    """
    try:
        content = json.loads(path.read_text(encoding='utf-8'))
        kept = tuple(
            ParameterChange(str(entry['name']), float(entry['old']), float(entry['new'])) for entry in content['parameters']
        )
        return OldParameters(str(content['autopilot']), int(content['system']), kept)
    except OSError as problem:
        raise InputError(f'{path}: {problem.strerror}; {WANTED}') from problem
    except (ValueError, KeyError, TypeError) as problem:
        raise InputError(f'{path} is no file of old parameters ({problem}); {WANTED}') from problem
