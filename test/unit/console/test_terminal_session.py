"""The keys of a person at a terminal, and what the screen shows of them, without a terminal or a graph."""

from __future__ import annotations

import io
from collections.abc import Mapping
from concurrent.futures import Future
from typing import Any

import pytest
from rich.console import Console

from advise_ros.console import views, wording
from advise_ros.console.board import Board
from advise_ros.console.keyboard import KEYS, SEQUENCES, decode, help_text
from advise_ros.console.language import words
from advise_ros.console.screen import screen
from advise_ros.console.terminal_session import TerminalSession
from advise_ros.core.advice.advice import Verdict
from advise_ros.core.demonstrations.demonstration import count
from advise_ros.core.learning.session import Session
from advise_ros.ros import convert_advice
from support.learning import ready
from support.sites import asking


class NoDesk:
    """Notes what is asked of it; nothing is ever replied."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, Mapping[str, Any]]] = []

    def act(self, name: str, given: Mapping[str, Any]) -> Future[dict[str, Any]]:
        self.asked.append((name, given))
        return Future()


class Seat:
    """A sitting before a question of a real session."""

    def __init__(self, session: Session | None = None, language: str = 'en') -> None:
        session = session or ready()
        learned, query, taken = session.learned, session.query, count(session.grid, session.demonstrations)
        assert learned is not None and query is not None
        policy = convert_advice.policy_to_msg(learned, 0)
        self.board, self.desk, self.grid, self.query = Board(), NoDesk(), session.grid, query
        self.sitting = TerminalSession(self.desk, 'Anna', words(language))  # type: ignore[arg-type]
        self.board.put('map', views.map_view(session.grid))
        self.board.put('flown', views.flown_view(session.grid, session.demonstrations))
        self.board.put('policy', views.policy_view(policy, session.grid, taken, learned.settings))
        states = list(query.states)
        moments = views.moments_of(query, session.grid, session.demonstrations)
        view = views.query_view(query, moments, taken.taken[states].sum(axis=0))
        said = {code: wording.asked(words(code), view, session.grid, taken.taken) for code in ('en', 'de')}
        self.board.put('query', {**view, 'said': said})
        self.sitting.hear(self.board.sections)

    def type(self, keys: bytes) -> None:
        meant, rest = decode(keys)
        assert not rest
        for one in meant:
            self.sitting.key(one)

    def sees(self, columns: int = 160, lines: int = 50) -> str:
        console = Console(width=columns, record=True, file=io.StringIO())
        console.print(screen(self.board.sections, self.sitting, '/advise/answer', '/', (columns, lines)))
        return console.export_text()


@pytest.fixture
def seat() -> Seat:
    return Seat()


def test_a_split_is_drawn_by_arrows_and_sent(seat: Seat) -> None:
    seat.type(b'm\r')
    assert not seat.desk.asked, 'nothing is marked yet'
    seat.type(b'x')
    drawing = seat.sitting.drawing
    assert drawing is not None and drawing.part == {drawing.layer * seat.grid.n_cells + drawing.cell}
    assert '+' in seat.sees() and f'You say: 1 of {len(seat.query.states)} cells goes another way' in seat.sees()
    marked = sorted(drawing.part)
    seat.type(b'\r')
    ((name, given),) = seat.desk.asked
    assert (name, given['verdict'], given['part'], given['preferred']) == ('answer', Verdict.SPLIT, marked, [])
    assert seat.sitting.drawing is None


def test_the_cursor_stays_on_the_map_and_marks_only_what_is_asked(seat: Seat) -> None:
    seat.type(b'm' + 9 * b'l' + 9 * b'k')
    drawing = seat.sitting.drawing
    assert drawing is not None and drawing.cell == seat.grid.n_cells - 1
    not_asked = next(state for state in range(seat.grid.n_states) if state not in seat.query.states)
    drawing.layer, drawing.cell = divmod(not_asked, seat.grid.n_cells)
    seat.type(b'x')
    assert not drawing.part
    seat.type(b'\x7f')
    assert seat.sitting.drawing is None
    seat.type(b'ma')
    assert seat.desk.asked[-1][1]['verdict'] == Verdict.MIXED


def test_flown_moments_and_the_heat_are_shown_in_turn(seat: Seat) -> None:
    moments = seat.board.sections['query'].value['moments']
    for number, moment in enumerate(moments, start=1):
        seat.type(b'r')
        assert f'{moment["id"]} ({number} / {len(moments)})' in ' '.join(seat.sees().split())
        assert seat.sitting.layer == moment['layer']
    seat.type(b'r')
    assert seat.sitting.moment == -1
    seat.type(b'v')
    assert '0 … 9 sure … unsure' in ' '.join(seat.sees().split())


def test_one_key_answers_a_question_about_a_site() -> None:
    _, session = asking()
    seat = Seat(session)
    keep, through = seat.query.options
    seat.board.put('site', {'keepOut': [90 if cell in seat.query.disputed else 0 for cell in range(seat.grid.n_cells)]})
    seen = seat.sees()
    assert f'y  {keep.label}' in seen and f'n  {through.label}' in seen
    assert seat.query.question.split('?')[0] in ' '.join(seen.split())
    seat.type(b'w')
    assert 'The answer is expected to save' in seat.sees()
    assert seen.count('?') >= len(seat.query.disputed)
    assert 'tenths likely to be kept out of' in ' '.join(seen.split())
    seat.type(b'n')
    ((name, given),) = seat.desk.asked
    assert (name, given['verdict'], given['comment']) == ('answer', Verdict.ANSWER, through.label)
    assert (given['preferred'], given['avoided']) == (list(through.preferred), list(through.avoided))


def test_without_a_yes_or_no_its_keys_say_so(seat: Seat) -> None:
    seat.type(b'y')
    assert not seat.desk.asked
    assert 'This question has no yes or no' in seat.sees()


@pytest.mark.parametrize(('key', 'act'), [
    (b' ', 'hold'), (b'f', 'fly'), (b'T', 'takeoff'), (b'G', 'land'), (b'R', 'record_start'), (b'S', 'record_stop'),
    (b'D', 'record_discard'),
])  # fmt: skip
def test_the_drone_is_a_key_away(seat: Seat, key: bytes, act: str) -> None:
    seat.type(key)
    assert seat.desk.asked == [(act, {})]


def test_troubles_and_gains_are_told(seat: Seat) -> None:
    told = (('guard', 'warn', 'the fence stops'), ('advise', 'silent', 'asks'), ('recorder', 'ok', 'all is well'))
    seat.board.put('nodes', [{'name': name, 'level': level, 'message': message} for name, level, message in told])
    entry = {
        'id': 1, 'query': 1, 'states': [0], 'preferred': [1], 'avoided': [3], 'verdict': 0, 'by': 'Anna', 'entry': 1,
        'retracted': False, 'back': 0,
    }
    seat.board.put('log', [entry])
    seat.board.put('gains', {'since': 0, 'gains': [{'entry': 1, 'changed': 5, 'success': 0.25, 'reaches': False}]})
    seen = seat.sees()
    assert '! guard: the fence stops' in seen and '! advise: silent; it said last: asks' in seen
    assert '1: EAST, not WEST, Anna' in seen and 'changed 5 cells, then 25\u00a0% expected' in seen
    assert 'all is well' not in seen


def test_every_key_does_one_thing_and_is_in_the_help() -> None:
    typed = [sequence for key in KEYS for sequence in key.typed]
    assert len(typed) == len(set(typed)) == len(SEQUENCES)
    assert [meant for sequence, meant in SEQUENCES.items() if meant == 'hold'] == ['hold'], 'the space bar alone holds'
    for code in ('en', 'de'):
        assert len(help_text(words(code)).splitlines()) == len(KEYS)


def test_backspace_clears_and_takes_no_answer_back(seat: Seat) -> None:
    seat.type(b'l\x7f\x7f')
    assert seat.sitting.preferred == ()
    assert [name for name, _ in seat.desk.asked] == ['preview']
    seat.type(b't')
    assert seat.desk.asked[-1] == ('undo', {})
    seat.type(b'l')
    seat.sitting.preview = {'ok': True, 'contradicts': [2, 4]}
    seat.type(b't')
    assert seat.desk.asked[-1] == ('retract', {'advice': 4})


def test_in_german() -> None:
    seat = Seat(language='de')
    seen = seat.sees()
    assert 'Auf dem Flug zu' in seen and 'Richtige Richtung' in seen and 'Drohne HALTEN' in seen
    seat.type(b'l')
    assert 'Antwort: OST richtig, WEST falsch.' in seat.sees()


@pytest.mark.parametrize('size', [20, 50])
def test_a_large_map_is_a_section_around_the_question_in_80_columns(size: int) -> None:
    seat = Seat()
    middle = size // 2 * size + size // 2
    seat.board.put('map', {
        'width': size, 'height': size, 'layers': 1, 'resolution': 1.0, 'origin': [0.0, 0.0], 'altitude': 5.0,
        'waypoints': [0], 'blocked': [],
    })  # fmt: skip
    seat.board.put('policy', {'greedy': '1' * size**2, 'unsure': '0' * size**2, 'success': 1.0, 'waypoints': 1})
    seat.board.put('query', {**seat.board.sections['query'].value, 'id': 9, 'states': [middle], 'moments': []})
    seat.sitting.hear(seat.board.sections)

    def shown(text: str) -> list[str]:
        assert max(map(len, text.splitlines())) <= 80
        return next(line for line in reversed(text.splitlines()) if line.startswith('│      ')).strip('│ ').split()

    seen = seat.sees(80, 30)
    assert '#' in seen and '▶' in seen
    columns = shown(seen)
    assert len(columns) == (80 - 8) // 5 and str(size // 2 + 1) in columns
    seat.type(b'))')
    moved = shown(seat.sees(80, 30))
    assert int(moved[0]) > int(columns[0])
    seat.type(b'0')
    assert shown(seat.sees(80, 30)) == columns
    seat.type(b'\x1b[1;5D' * 40 + b'\x1b[1;5B' * 40)
    far = shown(seat.sees(80, 30))
    assert far[0] == '1'
