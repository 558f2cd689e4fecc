"""Files that appear whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from advise_ros.core.errors import InputError


def write_whole(path: Path, data: bytes) -> None:
    """Write a file, or leave what was there.

    Raises:
        InputError: it cannot be written.
    """
    draft = path.with_name(f'.{path.name}.{os.getpid()}')
    try:
        draft.write_bytes(data)
        draft.replace(path)
    except OSError as problem:
        draft.unlink(missing_ok=True)
        raise InputError(f'{path} cannot be written ({problem.strerror}); name a file in a folder that exists') from None
