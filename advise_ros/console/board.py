"""What a page shows, as immutable sections: written by the thread that listens to the graph, read by any other."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple


class Section(NamedTuple):
    """One part of the page; `version` counts up with every change."""

    version: int
    value: Any


class Board:
    """Holds the newest sections by name.

    Only one thread may `put`. A reader takes `sections` once and gets a whole that does not change any more.
    """

    def __init__(self) -> None:
        self._sections: Mapping[str, Section] = MappingProxyType({})

    @property
    def sections(self) -> Mapping[str, Section]:
        return self._sections

    def put(self, name: str, value: Any) -> bool:
        """Replace a section if it differs; the value must not be changed afterwards."""
        old = self._sections.get(name)
        if old is not None and old.value == value:
            return False
        section = Section(old.version + 1 if old else 1, value)
        self._sections = MappingProxyType({**self._sections, name: section})
        return True


def newer(sections: Mapping[str, Section], known: Mapping[str, int]) -> dict[str, Section]:
    """The sections that a reader who knows these versions has not seen."""
    return {name: section for name, section in sections.items() if section.version != known.get(name)}
