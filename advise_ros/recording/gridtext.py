"""The text of a grid file: the same grid gives the same bytes, and no file is written half or over another one."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

CELLS_A_LINE = 12
# The keys in the order in which they are written; what else there is follows.
ORDER = ('origin_wgs84', 'heading_deg', 'resolution', 'width', 'height', 'origin', 'altitude', 'waypoints', 'blocked')
NUMBERS = ('heading_deg', 'resolution', 'altitude')


def grid_text(values: Mapping[str, Any], head: str = '') -> str:
    """A grid file.

    Args:
        values: the keys below `grid:`, right or wrong.
        head: comments that it begins with.
    """
    return head + 'grid:\n' + ''.join(f'  {key}: {_flow(value)}\n' for key, value in canonical(values).items())


def canonical(values: Mapping[str, Any]) -> dict[str, Any]:
    """The same values in one order and one type each; what is wrong with them stays as it is.

    Args:
        values: the keys below `grid:`.
    """
    found = {key: values[key] for key in (*ORDER, *values) if key in values and (key in ORDER[2:] or values[key] is not None)}
    found.setdefault('blocked', [])
    for key in NUMBERS:
        if key in found:
            found[key] = _real(found[key])
    for key in ('origin', 'origin_wgs84'):
        if isinstance(found.get(key), list):
            found[key] = [_real(value) for value in found[key]]
    found['blocked'] = _sorted(found['blocked'] or [])
    return found


def _real(value: Any) -> Any:
    return float(value) if type(value) is int else value


def are_cells(value: Any) -> bool:
    """Whether a value is a list of [x, y] in whole numbers."""
    return isinstance(value, list) and all(
        isinstance(cell, list) and len(cell) == 2 and all(type(number) is int for number in cell) for cell in value
    )


def _sorted(cells: Any) -> Any:
    """By rows, each once; what is no list of cells as it is."""
    return [[x, y] for y, x in sorted({(y, x) for x, y in cells})] if are_cells(cells) else cells


def _flow(value: object) -> str:
    """YAML on one line, of many cells on several that are indented."""
    if isinstance(value, list) and len(value) > CELLS_A_LINE:
        lines = [', '.join(map(str, value[at : at + CELLS_A_LINE])) for at in range(0, len(value), CELLS_A_LINE)]
        return '[\n    ' + ',\n    '.join(lines) + ',\n  ]'
    return yaml.safe_dump(value, default_flow_style=True, width=1000, allow_unicode=True).removesuffix('...\n').strip()


def write_new(path: Path, text: str, *, replace: bool = False) -> None:
    """Write a file as a whole or not at all.

    Args:
        path: the file.
        text: what it holds afterwards.
        replace: it may take the place of another one.

    Raises:
        FileExistsError: there is one, and it is not to be replaced.
        OSError: it cannot be written; nothing is left.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f'.{path.name}.')
    written = Path(name)
    try:
        with os.fdopen(handle, 'w', encoding='utf-8') as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        written.chmod(0o666 & ~_umask())
        if replace:
            written.replace(path)
        else:
            os.link(written, path)
    finally:
        written.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
