"""One person at a terminal: the picks of an answer, its preview, and what came of it."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Mapping
from concurrent.futures import Future as Promise
from typing import Any

from advise_ros.console import language, wording
from advise_ros.console.board import Section
from advise_ros.console.drawing import Drawing
from advise_ros.console.language import Translator, mark
from advise_ros.console.requests import Reply, RequestDispatcher
from advise_ros.core.advice.advice import Verdict
from advise_ros.core.grid.grid import ACTION_STEP, N_ACTIONS

VERDICTS = {'send': Verdict.ANSWER, 'skip': Verdict.SKIP, 'unsure': Verdict.UNSURE, 'mixed': Verdict.MIXED}
# Acts that are sent at once, and what they are called.
ACTS = {
    'hold': mark('HOLD'), 'fly': mark('Fly the policy'), 'takeoff': mark('Take off'), 'land': mark('Land'),
    'record_start': mark('Record'), 'record_stop': mark('Stop'), 'record_discard': mark('Discard'),
}
# Cells that one key moves the map.
PAN_CELLS = 3


def assumed(preferred: tuple[int, ...]) -> tuple[int, ...]:
    """What counts as wrong when only what is right is named: the opposites, or where those are right too, the others."""
    opposite = tuple(sorted({(action + 2) % N_ACTIONS for action in preferred} - set(preferred)))
    return opposite or tuple(action for action in range(N_ACTIONS) if action not in preferred)


class TerminalSession:
    """What a person does with the keys.

    Attributes:
        preferred, avoided: the picks.
        layer: of the map that is shown.
        preview: the reply to the present picks, None while there is none.
        drawing: the split that is being drawn, None else.
        heat: the map tells how unsure the learner is.
        moment: which flown moment behind the question the map shows, -1: none.
        note: what came of the last act, in words.
        pan: how far the map was moved from the question, cells to the east and north.
        why: the reasons of the question are shown.
        over: the person has left.
    """

    def __init__(self, desk: RequestDispatcher, name: str, words: Translator | None = None) -> None:
        self._desk, self._name, self.words = desk, name, words or language.words(language.ENGLISH)
        self.pan: tuple[int, ...] = (0, 0)
        self.preferred: tuple[int, ...] = ()
        self.avoided: tuple[int, ...] = ()
        self.layer = 0
        self.preview: Reply | None = None
        self.note = ''
        self.help = self.over = self.heat = self.why = False
        self.drawing: Drawing | None = None
        self.moment = -1
        self._grid: Mapping[str, Any] | None = None
        self._query: Mapping[str, Any] = {'id': 0, 'states': [], 'moments': [], 'options': []}
        self._pending: list[tuple[str, Promise[Reply]]] = []
        self._previewing: Promise[Reply] | None = None

    @property
    def wrong(self) -> tuple[int, ...]:
        """The avoided directions, or those that are taken for it."""
        return self.avoided or (assumed(self.preferred) if self.preferred else ())

    @property
    def sentence(self) -> str:
        """The answer so far in words."""
        if self.drawing is not None:
            return self.drawing.sentence(self.words)
        if not self.preferred and self._query['options']:
            return self.words.t('y or n answers at once; or name directions for the cells marked # (arrow keys).')
        if not self.preferred:
            return self.words.t('Choose the right direction for the cells marked # (arrow keys).')
        right, wrong = (wording.names(self.words, actions) for actions in (self.preferred, self.wrong))
        return self.words.t('You say: {right} right, {wrong} wrong. (Enter sends)', right=right, wrong=wrong)

    # -- what is heard -----------------------------------------------------------------------
    def hear(self, sections: Mapping[str, Section]) -> None:
        """A new question clears the picks and shows its first map."""
        self._grid = sections['map'].value if 'map' in sections else None
        query = sections['query'].value if 'query' in sections else self._query
        if query['id'] != self._query['id']:
            self.preferred, self.avoided, self.preview = (), (), None
            self.drawing, self.moment, self.pan = None, -1, (0, 0)
            if query['states'] and self._grid is not None:
                size = self._grid['width'] * self._grid['height']
                layers = [state // size for state in query['states']]
                self.layer = max(sorted(set(layers)), key=layers.count)
        self._query = query

    def poll(self) -> bool:
        """Look after what is under way; True when something has come."""
        done = [(what, promise) for what, promise in self._pending if promise.done()]
        for what, promise in done:
            self._pending.remove((what, promise))
            reply = wording.reply_in(self.words, promise.result())
            text = '{what}: {message}' if reply['ok'] else self.words.t('{what} was not taken: {message}')
            self.note = text.format(what=what, message=reply['message'])
        if self._previewing is not None and self._previewing.done():
            self.preview, self._previewing = wording.reply_in(self.words, self._previewing.result()), None
            return True
        return bool(done)

    # -- keys --------------------------------------------------------------------------------
    def key(self, meant: str) -> None:
        """Do what a key means."""
        word, _, number = meant.partition(' ')
        if word in ('prefer', 'avoid'):
            self._arrow(word, int(number))
        elif word == 'layer':
            self._go_to(int(number))
        elif word == 'option':
            self._choose(int(number))
        elif word == 'pan':
            east, north = ACTION_STEP[int(number)]
            most = max(self._grid['width'], self._grid['height']) if self._grid is not None else 0
            moved = (at + PAN_CELLS * step for at, step in zip(self.pan, (east, north), strict=True))
            self.pan = tuple(max(-most, min(most, at)) for at in moved)
        elif meant in VERDICTS:
            self._answer(meant)
        elif meant in ACTS:
            self._begin(self.words.t(ACTS[meant]), self._desk.act(meant, {}))
        else:
            others: dict[str, Callable[[], None]] = {
                'others': self._avoid_others, 'clear': self._clear, 'split': self._split, 'centre': self._centre,
                'why': self._why,
                'take back': self._take_back, 'help': self._help,
                'quit': self._quit, 'mark': self._mark, 'heat': self._heat, 'replay': self._replay,
            }
            others[meant]()

    def _arrow(self, kind: str, action: int) -> None:
        if self.drawing is not None:
            self.drawing.move(action)
        else:
            self._pick(kind, action)

    def _answer(self, meant: str) -> None:
        """Send, or begin to draw a split; while one is drawn, Enter sends it and m ends it."""
        if self.drawing is None and meant == 'mixed':
            self._draw()
        elif self.drawing is None:
            self._send(VERDICTS[meant])
        elif meant == 'send' and not self.drawing.is_ready:
            self.note = self.words.t('Mark some of the cells, not all.')
        elif meant == 'send':
            self._send(Verdict.SPLIT)
        elif meant == 'mixed':
            self.drawing = None
        else:
            self._send(VERDICTS[meant])

    def _split(self) -> None:
        if self.drawing is not None:
            self._send(Verdict.MIXED)

    def _centre(self) -> None:
        self.pan = (0, 0)

    def _why(self) -> None:
        self.why = not self.why

    def _choose(self, index: int) -> None:
        """The answer of one gesture: what it stands for is sent at once."""
        options = self._query['options']
        if index >= len(options):
            no = self.words.t('This question has no yes or no: name directions.')
            self.note = no if self._query['id'] else self.words.t('Nothing is asked now.')
            return
        given = {**self._given(Verdict.ANSWER), **{name: options[index][name] for name in ('preferred', 'avoided')}}
        self.preferred, self.avoided, self.preview, self.drawing = (), (), None, None
        self._deliver({**given, 'comment': options[index]['label']})

    def _draw(self) -> None:
        if self._query['id'] and self._grid is not None:
            self.preferred, self.avoided, self.preview = (), (), None
            self.drawing = Drawing(self._grid, tuple(self._query['states']), self.layer)
        else:
            self.note = self.words.t('Nothing is asked now.')

    def _go_to(self, layer: int) -> None:
        if self._grid is not None and layer < self._grid['layers']:
            self.layer, self.pan = layer, (0, 0)
            if self.drawing is not None:
                self.drawing.layer = layer

    def _mark(self) -> None:
        if self.drawing is not None:
            self.drawing.mark()

    def _heat(self) -> None:
        self.heat = not self.heat

    def _replay(self) -> None:
        """The next flown moment behind the question, after the last one none."""
        moments = self._query['moments']
        self.moment = self.moment + 1 if self.moment + 1 < len(moments) else -1
        if self.moment >= 0:
            self.layer = moments[self.moment]['layer']

    def _avoid_others(self) -> None:
        if self.drawing is not None:
            return
        self.avoided = tuple(action for action in range(N_ACTIONS) if action not in self.preferred)
        self._try()

    def _help(self) -> None:
        self.help = not self.help

    def _quit(self) -> None:
        self.over = True

    def _pick(self, kind: str, action: int) -> None:
        chosen, other = (self.preferred, self.avoided) if kind == 'prefer' else (self.avoided, self.preferred)
        chosen = tuple(sorted(set(chosen) ^ {action}))
        other = tuple(one for one in other if one != action)
        self.preferred, self.avoided = (chosen, other) if kind == 'prefer' else (other, chosen)
        self._try()

    def _given(self, verdict: Verdict) -> dict[str, Any]:
        said = verdict is Verdict.ANSWER
        return {
            'uid': secrets.token_hex(12), 'query': self._query['id'], 'states': self._query['states'], 'verdict': int(verdict),
            'preferred': list(self.preferred) if said else [], 'avoided': list(self.wrong) if said else [], 'by': self._name,
            'part': sorted(self.drawing.part) if self.drawing is not None and verdict is Verdict.SPLIT else [],
        }

    def _try(self) -> None:
        self.preview = self._previewing = None
        if self.preferred and self._query['id']:
            self._previewing = self._desk.act('preview', self._given(Verdict.ANSWER))

    def _send(self, verdict: Verdict) -> None:
        if not self._query['id'] or (verdict is Verdict.ANSWER and not self.preferred):
            first = self.words.t('Choose a right direction first.')
            self.note = first if self._query['id'] else self.words.t('Nothing is asked now.')
            return
        self._deliver(self._given(verdict))
        self.drawing = None

    def _deliver(self, given: dict[str, Any]) -> None:
        self.note = self.words.t('On its way; it is kept while the learner is away.')
        self._begin(self.words.t('Your answer'), self._desk.act('answer', given))

    def _clear(self) -> None:
        self.drawing = None
        self.preferred, self.avoided, self.preview = (), (), None

    def _take_back(self) -> None:
        """Take back the earlier answer that the present picks contradict, else the newest that holds."""
        against = list(self.preview.get('contradicts', [])) if self.preview else []
        if against:
            advice = against[-1]
            self._begin(self.words.t('Take back answer {id}', id=advice), self._desk.act('retract', {'advice': advice}))
        else:
            self._begin(self.words.t('Take back'), self._desk.act('undo', {}))

    def _begin(self, what: str, promise: Promise[Reply]) -> None:
        self._pending.append((what, promise))
