"""The demonstrations file (`demos.json`): what `discretise` writes and the learner can start from."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from advise_ros.core.demonstrations.demonstration import Audit, Demonstration, EndReason
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.recording.dataset import is_dataset, load_dataset


def save_demonstrations(path: str | Path, demonstrations: Sequence[Demonstration]) -> None:
    """Write the list; the file appears whole or not at all.

    Raises:
        InputError: the file cannot be written.
    """
    target = Path(path)
    draft = target.with_name(f'.{target.name}.{os.getpid()}')
    lines = ',\n'.join(json.dumps(to_record(demonstration)) for demonstration in demonstrations)
    try:
        draft.write_text(f'[\n{lines}\n]\n', encoding='utf-8')
        draft.replace(target)
    except OSError as problem:
        draft.unlink(missing_ok=True)
        raise InputError(f'{target} cannot be written ({problem.strerror}); name a file in a folder that exists') from None


def load_demonstrations(path: str | Path, grid: Grid) -> tuple[Demonstration, ...]:
    """Read the list, or a dataset; the grid is not in a list and must be the one it was made with.

    Raises:
        InputError: the file is missing, no JSON list, or an entry does not fit the grid or the format; or as load_dataset.
    """
    if is_dataset(path):
        return _of_dataset(path, grid)
    try:
        records = json.loads(Path(path).read_text(encoding='utf-8'))
    except FileNotFoundError:
        raise InputError(f'demonstrations file {path}: there is no such file; make one with discretise') from None
    except OSError as problem:
        raise InputError(f'demonstrations file {path}: it cannot be read ({problem.strerror})') from None
    except ValueError:
        raise InputError(f'demonstrations file {path}: it is not JSON; make one with discretise') from None
    if not isinstance(records, list):
        raise InputError(f'demonstrations file {path}: it is not a list; make one with discretise')
    return tuple(_checked(path, index, record, grid) for index, record in enumerate(records))


def _of_dataset(path: str | Path, grid: Grid) -> tuple[Demonstration, ...]:
    dataset = load_dataset(path)
    if dataset.grid != grid:
        raise InputError(f'dataset {path} was made on another grid; name the grid file that discretise was given')
    return dataset.demonstrations


def to_record(demonstration: Demonstration) -> dict[str, Any]:
    """One entry of the file."""
    audit = asdict(demonstration.audit)
    audit['notes'] = list(demonstration.audit.notes)
    return {
        'id': demonstration.demonstration_id,
        'source': demonstration.source,
        'states': list(demonstration.states),
        'actions': list(demonstration.actions),
        'stamps_ns': list(demonstration.stamps_ns),
        'window_ns': list(demonstration.window_ns),
        'end_reason': demonstration.end_reason.name,
        'audit': audit,
    }


def from_record(record: dict[str, Any], grid: Grid) -> Demonstration:
    """One demonstration; `window_ns`, `end_reason` and parts of `audit` may be missing.

    Raises:
        InputError, KeyError, TypeError, ValueError: the record does not fit the format or the grid.
    """
    stamps_ns = _whole(record['stamps_ns'])
    window = _whole(record.get('window_ns', stamps_ns[:1] + stamps_ns[-1:] or (0, 0)))
    if len(window) != 2:
        raise ValueError('window_ns is not a pair')
    return Demonstration(
        demonstration_id=str(record['id']),
        source=str(record['source']),
        grid=grid,
        states=_whole(record['states']),
        actions=_whole(record['actions']),
        stamps_ns=stamps_ns,
        window_ns=(window[0], window[1]),
        end_reason=EndReason[record.get('end_reason', EndReason.END_OF_LOG.name)],
        audit=_audit(record.get('audit', {})),
    )


def _checked(path: str | Path, index: int, record: Any, grid: Grid) -> Demonstration:
    try:
        return from_record(record, grid)
    except InputError as problem:
        raise InputError(f'demonstrations file {path}: {problem}; was it made with another grid?') from None
    except (KeyError, TypeError, ValueError, AttributeError) as problem:
        reason = f'{problem} is missing or unknown' if isinstance(problem, KeyError) else str(problem)
        raise InputError(f'demonstrations file {path}: entry {index} is malformed ({reason}); make it with discretise') from None


def _audit(values: dict[str, Any]) -> Audit:
    known = {spec.name for spec in fields(Audit)} & values.keys()
    counts: dict[str, Any] = {name: values[name] for name in known - {'notes'}}
    if any(isinstance(count, bool) or not isinstance(count, (int, float)) for count in counts.values()):
        raise ValueError('audit holds something that is not a number')
    return Audit(**counts, notes=tuple(str(note) for note in values.get('notes', ())))


def _whole(values: Any) -> tuple[int, ...]:
    if not isinstance(values, (list, tuple)) or any(type(value) is not int for value in values):
        raise ValueError(f'{values!r} is not a list of whole numbers')
    return tuple(values)
