"""A dataset: the demonstrations of many recordings in one directory, `dataset.yaml` beside `demonstrations.npz`.

dataset.yaml has the grid, the settings, each recording, those that gave nothing, and the sha256 of the npz.
demonstrations.npz holds n demonstrations with m moves in all, without pickle:

    ids, sources, notes  (n,) text; notes as a JSON list
    begins               (n + 1,) int64: the moves of demonstration i are begins[i] up to begins[i + 1]
    states, actions      (m,) uint32 and uint8
    stamps_ns            (m,) int64, when each state was entered
    windows_ns           (n, 2) int64, first and last stamp looked at
    end_reasons          (n,) uint8, as advise_msgs/Demonstration
    audits               (n, 6) int64: samples, late, unstamped, out_of_grid, cell_skips, ambiguous_actions
    max_gaps_s           (n,) float64
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import advise_ros
from advise_ros.core.demonstrations.demonstration import Audit, Demonstration, EndReason
from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.recording.gridfile import grid_from_mapping, grid_to_mapping

FORMAT = 1
DATASET_FILE, ARRAYS_FILE = 'dataset.yaml', 'demonstrations.npz'
COUNTS = ('samples', 'late', 'unstamped', 'out_of_grid', 'cell_skips', 'ambiguous_actions')
REMEDY = 'make it again with discretise --out DIRECTORY'


@dataclass(frozen=True)
class Dataset:
    """What a dataset holds.

    Attributes:
        settings: by which samples became moves.
        recordings: path -> how many demonstrations it gave.
        failures: one sentence for each recording that gave none.
    """

    grid: Grid
    demonstrations: tuple[Demonstration, ...]
    settings: DiscretiseSettings = DiscretiseSettings()
    recordings: Mapping[str, int] | None = None
    failures: tuple[str, ...] = ()


def save_dataset(directory: str | Path, dataset: Dataset) -> Path:
    """Write both files; dataset.yaml comes last, so a directory that has it is whole. Returns its path.

    Raises:
        InputError: they cannot be written.
    """
    target = Path(directory)
    out = BytesIO()
    np.savez_compressed(out, **_arrays(dataset.demonstrations))
    arrays = out.getvalue()
    values = {
        'advise_dataset': FORMAT,
        'made_by': f'advise_ros {advise_ros.__version__}',
        'grid': grid_to_mapping(dataset.grid),
        'settings': asdict(dataset.settings),
        'arrays': {'file': ARRAYS_FILE, 'sha256': hashlib.sha256(arrays).hexdigest()},
        'demonstrations': len(dataset.demonstrations),
        'moves': sum(len(one.states) for one in dataset.demonstrations),
        'recordings': [{'path': path, 'demonstrations': count} for path, count in (dataset.recordings or {}).items()],
        'failures': list(dataset.failures),
    }
    try:
        target.mkdir(parents=True, exist_ok=True)
        (target / ARRAYS_FILE).write_bytes(arrays)
        draft = target / f'.{DATASET_FILE}'
        draft.write_text(yaml.safe_dump(values, sort_keys=False, width=120), encoding='utf-8')
        draft.replace(target / DATASET_FILE)
    except OSError as problem:
        raise InputError(f'dataset {target} cannot be written ({problem.strerror}); name another directory') from None
    return target / DATASET_FILE


def is_dataset(path: str | Path) -> bool:
    """Whether a path names a dataset: its directory or its dataset.yaml."""
    return Path(path).is_dir() or Path(path).suffix in ('.yaml', '.yml')


def load_dataset(path: str | Path) -> Dataset:
    """Read a dataset by its directory or its dataset.yaml.

    Raises:
        InputError: a file is missing, damaged or of another version, or its contents contradict themselves.
    """
    file = Path(path) / DATASET_FILE if Path(path).is_dir() else Path(path)
    try:
        values = yaml.safe_load(file.read_text(encoding='utf-8'))
        if values['advise_dataset'] != FORMAT:
            raise InputError(f'dataset {path}: its format is {values["advise_dataset"]}, this version reads {FORMAT}; {REMEDY}')
        return _loaded(file, values)
    except InputError:
        raise
    except OSError as problem:
        raise InputError(f'dataset {path}: {problem.filename} cannot be read ({problem.strerror}); {REMEDY}') from None
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, yaml.YAMLError, zipfile.BadZipFile) as problem:
        reason = str(problem).splitlines()[0] if str(problem) else type(problem).__name__
        raise InputError(f'dataset {path} is no dataset or damaged ({reason}); {REMEDY}') from None


def _loaded(file: Path, values: Any) -> Dataset:
    grid = grid_from_mapping(values['grid'])
    data = (file.parent / Path(values['arrays']['file']).name).read_bytes()
    if hashlib.sha256(data).hexdigest() != values['arrays']['sha256']:
        raise InputError(f'dataset {file}: {ARRAYS_FILE} is not the one that it was written with; {REMEDY}')
    with np.load(BytesIO(data), allow_pickle=False) as arrays:
        demonstrations = _demonstrations(grid, dict(arrays))
    recordings = {str(one['path']): int(one['demonstrations']) for one in values['recordings']}
    settings = DiscretiseSettings(**values['settings'])
    return Dataset(grid, demonstrations, settings, recordings, tuple(map(str, values['failures'])))


# -- arrays ----------------------------------------------------------------------------------------
def _arrays(demonstrations: Sequence[Demonstration]) -> dict[str, Any]:
    def joined(name: str, kind: str) -> Any:
        return np.array([value for one in demonstrations for value in getattr(one, name)], dtype=kind)

    return {
        'ids': np.array([one.demonstration_id for one in demonstrations], dtype=np.str_),
        'sources': np.array([one.source for one in demonstrations], dtype=np.str_),
        'notes': np.array([json.dumps(one.audit.notes) for one in demonstrations], dtype=np.str_),
        'begins': np.cumsum([0, *(len(one.states) for one in demonstrations)], dtype=np.int64),
        'states': joined('states', 'u4'),
        'actions': joined('actions', 'u1'),
        'stamps_ns': joined('stamps_ns', 'i8'),
        'windows_ns': np.array([one.window_ns for one in demonstrations], dtype=np.int64).reshape(-1, 2),
        'end_reasons': np.array([one.end_reason for one in demonstrations], dtype=np.uint8),
        'audits': np.array(
            [[getattr(one.audit, name) for name in COUNTS] for one in demonstrations], dtype=np.int64,
        ).reshape(-1, len(COUNTS)),
        'max_gaps_s': np.array([one.audit.max_gap_s for one in demonstrations], dtype=np.float64),
    }


def _demonstrations(grid: Grid, arrays: Mapping[str, Any]) -> tuple[Demonstration, ...]:
    begins = arrays['begins'].tolist()
    columns = [arrays[name].tolist() for name in ('states', 'actions', 'stamps_ns')]
    if sorted(begins) != begins or any(begins[-1] != len(column) for column in columns):
        raise ValueError('its arrays do not fit each other')
    rest = (arrays[name].tolist() for name in ('ids', 'sources', 'notes', 'windows_ns', 'end_reasons', 'audits', 'max_gaps_s'))
    return tuple(
        Demonstration(
            demonstration_id=identity, source=source, grid=grid,
            states=tuple(columns[0][begin:end]), actions=tuple(columns[1][begin:end]), stamps_ns=tuple(columns[2][begin:end]),
            window_ns=(window[0], window[1]), end_reason=EndReason(reason),
            audit=Audit(**dict(zip(COUNTS, counts, strict=True)), max_gap_s=gap_s, notes=tuple(json.loads(notes))),
        )
        for begin, end, identity, source, notes, window, reason, counts, gap_s in zip(begins[:-1], begins[1:], *rest, strict=True)
    )
