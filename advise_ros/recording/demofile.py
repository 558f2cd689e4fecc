"""The demonstrations file (`demos.json`): what `discretise` writes and the learner can start from.

A JSON mapping of `grid`, the keys of a grid file, and `demonstrations`, a list. States and actions mean something else on
another grid: a file of another one, and a mere list, as earlier versions wrote, are refused.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from advise_ros.core.demonstrations.demonstration import Audit, Demonstration, EndReason
from advise_ros.core.errors import InputError
from advise_ros.core.grid.differences import what_differs
from advise_ros.core.grid.grid import Grid
from advise_ros.recording.dataset import is_dataset, load_dataset
from advise_ros.recording.gridfile import grid_from_mapping, grid_to_mapping
from advise_ros.recording.whole_file import write_whole

# Of more recordings the first ones are named in an error.
RECORDINGS_NAMED = 4
READ_OF_IT = r' \(positions [^()]*\)$'


def save_demonstrations(path: str | Path, demonstrations: Sequence[Demonstration]) -> None:
    """Write them with the grid that they lie on; the file appears whole or not at all.

    Args:
        path: the file.
        demonstrations: at least one, all on one grid.

    Raises:
        InputError: the file cannot be written.
    """
    write_whole(Path(path), file_text(demonstrations).encode())


def file_text(demonstrations: Sequence[Demonstration]) -> str:
    """What the file holds.

    Args:
        demonstrations: at least one, all on one grid.
    """
    grid = json.dumps(grid_to_mapping(demonstrations[0].grid))
    lines = ',\n'.join(json.dumps(to_record(demonstration)) for demonstration in demonstrations)
    return f'{{"grid": {grid}, "demonstrations": [\n{lines}\n]}}\n'


def load_demonstrations(path: str | Path, grid: Grid) -> tuple[Demonstration, ...]:
    """Read the file, or a dataset.

    Raises:
        InputError: the file is missing, no demonstrations file, malformed, empty or of another grid, or two have one id;
            or as load_dataset.
    """
    if is_dataset(path):
        dataset = load_dataset(path)
        what, demonstrations = f'dataset {path}', dataset.demonstrations
        _check_grid(what, dataset.grid, grid, _sources([{'source': one.source} for one in demonstrations]))
    else:
        what, records = f'demonstrations file {path}', _records(path, grid)
        demonstrations = tuple(_checked(path, index, record, grid) for index, record in enumerate(records))
    if not demonstrations:
        raise InputError(f'{what}: it holds no demonstration; make it again with discretise, or name no file')
    first: dict[str, int] = {}
    for index, one in enumerate(demonstrations):
        if first.setdefault(one.demonstration_id, index) != index:
            where = f'entries {first[one.demonstration_id]} and {index}'
            raise InputError(f'{what}: {where} have the same id {one.demonstration_id!r}; give each its own')
    return demonstrations


def _records(path: str | Path, grid: Grid) -> list[Any]:
    """The entries of a file of this grid."""
    values = _read(path)
    if isinstance(values, list):
        raise InputError(
            f'demonstrations file {path}: it does not say which grid it was made on; {_again(_sources(values))}, '
            f'or, if you know the grid, write {{"grid": {{...}}, "demonstrations": [...]}} around the list'
        )
    if not isinstance(values, dict) or not isinstance(values.get('demonstrations'), list) or 'grid' not in values:
        raise InputError(f"demonstrations file {path}: it has no 'grid' and list 'demonstrations'; make one with discretise")
    records = values['demonstrations']
    try:
        made_on = grid_from_mapping(values['grid'])
    except (InputError, TypeError, AttributeError) as problem:
        raise InputError(f'demonstrations file {path}: its grid is malformed ({problem}); {_again(_sources(records))}') from None
    _check_grid(f'demonstrations file {path}', made_on, grid, _sources(records))
    return records


def _read(path: str | Path) -> Any:
    try:
        return json.loads(Path(path).read_text(encoding='utf-8-sig'))  # Some editors put a byte order mark in front.
    except FileNotFoundError:
        raise InputError(f'demonstrations file {path}: there is no such file; make one with discretise') from None
    except OSError as problem:
        raise InputError(f'demonstrations file {path}: it cannot be read ({problem.strerror})') from None
    except ValueError:
        raise InputError(f'demonstrations file {path}: it is not JSON; make one with discretise') from None


def _check_grid(what: str, made_on: Grid, grid: Grid, sources: Sequence[str]) -> None:
    if made_on != grid:
        raise InputError(f'{what} was made on another grid ({what_differs(made_on, grid)}); {_again(sources)}')


def _sources(records: Sequence[Any]) -> list[str]:
    """The recordings, without what was read of each: 'flight.mcap (positions /pose, ...)'."""
    return [
        re.sub(READ_OF_IT, '', str(record['source'])) for record in records if isinstance(record, dict) and 'source' in record
    ]


def _again(sources: Sequence[str]) -> str:
    """How to make demonstrations on the grid in use, from the recordings where these are at hand."""
    recordings = [source for source in dict.fromkeys(sources) if Path(source).exists()]
    named = ' '.join(recordings[:RECORDINGS_NAMED]) + (' ...' if len(recordings) > RECORDINGS_NAMED else '')
    return f'make it again on this grid: ./advise discretise {named or "RECORDING"} --grid GRID --out OUT'


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
        raise InputError(f'demonstrations file {path}: {problem}; make it again with discretise') from None
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
