"""A split that is drawn at a terminal: a cursor on the map and the cells that go another way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from advise_ros.console.language import Translator
from advise_ros.core.grid.grid import ACTION_STEP


class Drawing:
    """The part of a question that is asked about apart.

    Attributes:
        part: its states.
        layer, cell: where the cursor is.
    """

    def __init__(self, grid: Mapping[str, Any], asked: tuple[int, ...], layer: int) -> None:
        self._grid, self._size, self._asked = grid, grid['width'] * grid['height'], frozenset(asked)
        here = sorted(state % self._size for state in asked if state // self._size == layer)
        self.part: set[int] = set()
        self.layer, self.cell = layer, here[0] if here else 0

    @property
    def is_ready(self) -> bool:
        """Some cells are marked, and some are not."""
        return 0 < len(self.part) < len(self._asked)

    def sentence(self, words: Translator) -> str:
        """What is said so far."""
        if not self.part:
            return words.t('Mark the cells that go another way: arrows move, x marks. (a: the drone splits them, m ends)')
        return words.tn(
            'You say: {n} of {all} cells goes another way than the rest. (Enter sends)',
            'You say: {n} of {all} cells go another way than the rest. (Enter sends)', len(self.part), all=len(self._asked),
        )

    def move(self, action: int) -> None:
        """One cell on, if it is on the map."""
        width, height = self._grid['width'], self._grid['height']
        x, y = (at + step for at, step in zip((self.cell % width, self.cell // width), ACTION_STEP[action], strict=True))
        if 0 <= x < width and 0 <= y < height:
            self.cell = y * width + x

    def mark(self) -> None:
        """Mark the cell under the cursor or not, if the question asks about it."""
        state = self.layer * self._size + self.cell
        if state in self._asked:
            self.part ^= {state}
