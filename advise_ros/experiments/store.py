"""Results trial by trial in a file, so that an interruption costs no more than the trials that were running."""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path
from types import TracebackType
from typing import Any

from advise_ros.core.errors import InputError

# Raise it when the same settings no longer give the same results: what is stored is then computed again.
HARNESS = 1


def key_of(*settings: object) -> str:
    """A name for what a result depends on; settings are compared by what they hold."""
    return sha256(repr((HARNESS, *settings)).encode()).hexdigest()[:16]


class Store:
    """Results by key and seed, kept as lines of JSON in the order in which they come.

    Raises:
        InputError: the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._results: dict[tuple[str, int], Any] = {}
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            whole = self._load(path)
            self._file = path.open('a', encoding='utf-8')
            if not whole:
                self._file.write('\n')
        except OSError as problem:
            raise InputError(f'{path} cannot be written ({problem.strerror}); name another directory') from problem

    def _load(self, path: Path) -> bool:
        """Read what is there; False when the last line was cut off in the middle."""
        text = path.read_text(encoding='utf-8') if path.exists() else ''
        for line in text.splitlines():
            try:
                entry = json.loads(line)
                self._results[entry['key'], entry['seed']] = entry['result']
            except (ValueError, KeyError, TypeError):
                continue  # Cut off by an interruption; that trial runs again.
        return not text or text.endswith('\n')

    def __enter__(self) -> Store:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._file.close()

    def __contains__(self, key: tuple[str, int]) -> bool:
        return key in self._results

    def __getitem__(self, key: tuple[str, int]) -> Any:
        return self._results[key]

    def add(self, key: tuple[str, int], result: Any) -> None:
        """Keep a result; it is on disk when this returns."""
        self._results[key] = result
        self._file.write(json.dumps({'key': key[0], 'seed': key[1], 'result': result}) + '\n')
        self._file.flush()
