"""The open question and the answers so far as text for the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from advise_ros.core.advice.advice import AdviceRecord, Answer, AnswerOption, Query
from advise_ros.core.grid.grid import Action, Grid
from advise_ros.ros.calls import in_words


def question_text(query: Query, grid: Grid) -> str:
    """The sentence, the answers that it offers, and one map for each waypoint that it is about."""
    layers = sorted({grid.next_waypoint(state) for state in query.states})
    budget = '' if query.budget_left < 0 else f' ({query.budget_left} answers left)'
    lines = [f'Query {query.query_id}{budget}: {query.question}']
    lines += [f'  {option.word}: {_meaning(query, option)}' for option in query.options]
    keys = '? in dispute, # asked about, X blocked' if query.disputed else '# asked about, X blocked'
    for layer in layers:
        asked = {grid.cell_of(state) for state in query.states if grid.next_waypoint(state) == layer}
        lines += ['', f'on the way to waypoint {layer + 1} ({keys}, digits: waypoints; north is up):']
        lines += _map(grid, asked, frozenset(query.disputed))
    return '\n'.join(lines)


def _meaning(query: Query, option: AnswerOption) -> str:
    """E.g. 'keep out; in the 3 cells asked about NORTH is right, EAST wrong'."""
    right, wrong = (' and '.join(Action(action).name for action in actions) for actions in (option.preferred, option.avoided))
    cells = '1 cell' if len(query.states) == 1 else f'{len(query.states)} cells'
    return f'{option.label.split(": ")[-1]}; in the {cells} asked about {right} right, {wrong} wrong'


def _map(grid: Grid, asked: set[int], disputed: frozenset[int]) -> list[str]:
    return [
        '  ' + ' '.join(_cell(grid, grid.cell(x, y), asked, disputed).rjust(2) for x in range(grid.width))
        for y in reversed(range(grid.height))
    ]


def _cell(grid: Grid, cell: int, asked: set[int], disputed: frozenset[int]) -> str:
    """A waypoint that is asked about reads e.g. '#2'."""
    mark = '?' if cell in disputed else '#' if cell in asked else 'X' if grid.is_blocked(cell) else ''
    number = str(grid.waypoints.index(cell) + 1) if cell in grid.waypoints else ''
    return mark + number or '.'


def log_text(log: Sequence[AdviceRecord]) -> str:
    """One line an answer, with its id."""
    gone = {record.advice_id for record in log if record.retracted}
    lines = ['Answers so far (id: what was said):']
    for record in log:
        if not record.retracted:
            said = in_words(Answer(record.query_id, record.verdict, record.preferred, record.avoided))
            by = f', by {record.expert_id}' if record.expert_id else ''
            lines.append(f'  {record.advice_id}: {said}{by}' + (' (taken back)' if record.advice_id in gone else ''))
    return '\n'.join(lines) if len(lines) > 1 else 'No answers so far.'
