"""The demonstrations of the session as a person sees them: a list with names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from advise_ros.console.board import Board
from advise_ros.console.flight_goals import Reply, no
from advise_ros.console.language import mark
from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.units import NS
from advise_ros.recording.demofile import file_text

ENDS = {
    'final_waypoint': mark('route flown'), 'landed': mark('landed'), 'disarmed': mark('disarmed'),
    'stopped': mark('stopped by hand'),
}
ELSE = mark('ended early')


class Lessons:
    """Puts the section `lessons` on the board.

    Names are the console's: they live as long as it does.
    """

    def __init__(self, board: Board) -> None:
        self._board = board
        self._held: tuple[Demonstration, ...] = ()
        self._names: dict[str, str] = {}

    def show(self, held: Sequence[Demonstration]) -> None:
        """Show these, and no others any more."""
        self._held = tuple(held)
        self._board.put('lessons', [lesson_view(one, self._names.get(one.demonstration_id, '')) for one in self._held])

    def rename(self, demonstration_id: str, name: str) -> Reply:
        """Call a demonstration something, '' nothing.

        Args:
            demonstration_id: of the demonstration.
            name: for people.
        """
        if demonstration_id not in {one.demonstration_id for one in self._held}:
            return no(f'there is no demonstration {demonstration_id} any more')
        self._names[demonstration_id] = name
        self.show(self._held)
        return {'ok': True, 'message': f'{demonstration_id} is called {name}' if name else f'{demonstration_id} has no name'}

    def file(self) -> Reply:
        """All of them, as `discretise` writes them and the learner's demonstrations_file reads them."""
        if not self._held:
            return no(mark('there is no demonstration yet'))
        return {'ok': True, 'message': f'{len(self._held)} demonstrations', 'text': file_text(self._held)}


def lesson_view(demonstration: Demonstration, name: str) -> dict[str, Any]:
    """One demonstration: its cells with the second of each, and what people call it."""
    begin_ns, end_ns = demonstration.window_ns
    return {
        'id': demonstration.demonstration_id, 'name': name, 'moves': len(demonstration.states), 'at': begin_ns / NS,
        'seconds': (end_ns - begin_ns) / NS, 'end': ENDS.get(demonstration.end_reason.name.lower(), ELSE),
        'cells': [demonstration.grid.cell_of(state) for state in demonstration.states],
        'times': [round((stamp - begin_ns) / NS, 1) for stamp in demonstration.stamps_ns],
    }
