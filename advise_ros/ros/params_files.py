"""Files of parameters on a node's command line: whom their keys mean, and keys that mean nobody."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml

OPTION = '--params-file'
WILDCARDS = ('*', '**')
# A key this near to a node's name is likely meant for it ('advize', 'mavlink-bridge').
NEAR = 0.7


class Entry(NamedTuple):
    """Parameters of one key of a file; namespaces may be keys above it."""

    key: str
    values: Mapping[str, Any]

    @property
    def last(self) -> str:
        """The node's name in the key."""
        return self.key.rsplit('/', 1)[-1]

    @property
    def general(self) -> bool:
        """Nodes of any name are meant."""
        return self.last in WILDCARDS


class ParamsFile(NamedTuple):
    """One file."""

    path: Path
    entries: tuple[Entry, ...]

    def fitting(self, full_name: str) -> tuple[Entry, ...]:
        """The entries that a node reads.

        Args:
            full_name: of the node, with its namespace.
        """
        return tuple(entry for entry in self.entries if fits(full_name, entry.key))

    def remark(self, full_name: str, names: Collection[str]) -> str:
        """What is wrong with the keys, as far as the node may be meant; '' if nothing is.

        Args:
            full_name: of the node, with its namespace.
            names: of all nodes of the package.
        """
        mine, name = self.fitting(full_name), full_name.rsplit('/', 1)[-1]
        if any(not entry.general for entry in mine):
            return ''
        others = {*names, name}
        for entry in (one for one in self.entries if one not in mine and not one.general):
            if entry.last == name and not mine:
                return (
                    f"{self.path}: '{entry.key}' is not {full_name}, and nothing below it is read; write '{full_name}:', or "
                    f"'/**/{name}:' for any namespace"
                )
            if entry.last not in others and _nearly(entry.last, others) == [name]:
                return f"{self.path}: '{entry.key}' is no node, and nothing below it is read; the nearest is '{full_name}'"
        if mine or any(entry.general or entry.last in others or _nearly(entry.last, others) for entry in self.entries):
            return ''
        keys = ', '.join(f"'{entry.key}'" for entry in self.entries) or 'none'
        return f"{self.path} has nothing for {full_name}; its keys: {keys}; write '{full_name}:' and 'ros__parameters:' below it"


def _nearly(key: str, names: Collection[str]) -> list[str]:
    return difflib.get_close_matches(key, names, 1, NEAR)


def named_in(args: Sequence[str]) -> list[ParamsFile]:
    """The files on a command line; those that cannot be read are rcl's to refuse."""
    paths = [Path(args[index + 1]) for index, word in enumerate(args[:-1]) if word == OPTION]
    return [found for path in paths if (found := _read(path)) is not None]


def _read(path: Path) -> ParamsFile | None:
    try:
        tree = yaml.safe_load(path.read_text(encoding='utf-8'))
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return None
    return ParamsFile(path, tuple(entries(tree)))


def entries(tree: Any) -> Iterator[Entry]:
    """The entries of a file's document, in order; none of what is no mapping."""
    yield from _entries(tree if isinstance(tree, Mapping) else {})


def _entries(tree: Mapping[Any, Any], above: str = '') -> Iterator[Entry]:
    for key, below in tree.items():
        if key == 'ros__parameters':
            yield Entry(above, below if isinstance(below, Mapping) else {})
        elif isinstance(below, Mapping):
            yield from _entries(below, f'{above}/{str(key).strip("/")}')


def fits(full_name: str, key: str) -> bool:
    """Whether a key means a node, as rcl reads it: * stands for one part of a name, ** for any number of them."""
    return _fits(full_name.strip('/').split('/'), key.strip('/').split('/'))


def _fits(name: list[str], pattern: list[str]) -> bool:
    if not pattern:
        return not name
    if pattern[0] == '**':
        return any(_fits(name[start:], pattern[1:]) for start in range(len(name) + 1))
    return bool(name) and pattern[0] in ('*', name[0]) and _fits(name[1:], pattern[1:])
