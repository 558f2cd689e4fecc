"""Keys of a terminal that answers questions: what a person types, and what it means."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from advise_ros.console.language import Translator, mark
from advise_ros.core.grid.grid import Action

# A terminal sends the arrows as ESC [ A or ESC O A, with Shift as ESC [ 1 ; 2 A, with Ctrl as ESC [ 1 ; 5 A; for terminals that
# keep these to themselves the letters h j k l do the same as the arrows, capitals as with Shift, and brackets move the map.
_ARROWS = (
    (b'A', b'k', b']', Action.NORTH), (b'C', b'l', b')', Action.EAST),
    (b'B', b'j', b'[', Action.SOUTH), (b'D', b'h', b'(', Action.WEST),
)


class KeyBinding(NamedTuple):
    """Keys of one meaning.

    Attributes:
        shown: as a person reads it.
        typed: what a terminal sends -> what is meant; each means one thing.
        text: what it does, for the help.
        often: it is named below the question, too.
    """

    shown: str
    typed: Mapping[bytes, str]
    text: str
    often: bool = False


def _one(shown: str, typed: bytes, meant: str, text: str, *, often: bool = False) -> KeyBinding:
    return KeyBinding(shown, {typed: meant}, text, often)


KEYS = (
    _one('Space', b' ', 'hold', mark('HOLD the drone'), often=True),
    KeyBinding('y, n', {b'y': 'option 0', b'n': 'option 1'}, mark('first or second answer, at once'), often=True),
    KeyBinding('arrows, h j k l', {
        **{lead + arrow: f'prefer {action}' for arrow, _, _, action in _ARROWS for lead in (b'\x1b[', b'\x1bO')},
        **{letter: f'prefer {action}' for _, letter, _, action in _ARROWS},
    }, mark('this direction is right (while you mark cells: move)'), often=True),
    KeyBinding('Shift+arrows, H J K L', {
        **{b'\x1b[1;2' + arrow: f'avoid {action}' for arrow, _, _, action in _ARROWS},
        **{letter.upper(): f'avoid {action}' for _, letter, _, action in _ARROWS},
    }, mark('this direction is wrong')),
    _one('o', b'o', 'others', mark('all other directions are wrong')),
    KeyBinding('Enter', {b'\r': 'send', b'\n': 'send'}, mark('send the directions or the marked cells'), often=True),
    KeyBinding('Backspace', {b'\x7f': 'clear', b'\x08': 'clear'}, mark('clear what you picked')),
    _one('s', b's', 'skip', mark('skip this question'), often=True),
    _one('u', b'u', 'unsure', mark('I am unsure'), often=True),
    _one('m', b'm', 'mixed', mark('these cells differ: mark those that go another way')),
    _one('x', b'x', 'mark', mark('mark the cell under the cursor')),
    _one('a', b'a', 'split', mark('let the drone split the cells')),
    _one('t', b't', 'take back', mark('take back the answer that is contradicted, else the last one'), often=True),
    KeyBinding('1-9', {str(layer).encode(): f'layer {layer - 1}' for layer in range(1, 10)}, mark('the map to this waypoint')),
    KeyBinding('Ctrl+arrows, ( ) [ ]', {
        **{b'\x1b[1;5' + arrow: f'pan {action}' for arrow, _, _, action in _ARROWS},
        **{letter: f'pan {action}' for _, _, letter, action in _ARROWS},
    }, mark('move the map')),
    _one('0', b'0', 'centre', mark('the map back to the question')),
    _one('w', b'w', 'why', mark('why it asks')),
    _one('v', b'v', 'heat', mark('where the drone is unsure')),
    _one('r', b'r', 'replay', mark('how it was flown there')),
    _one('f', b'f', 'fly', mark('fly the policy')), _one('T', b'T', 'takeoff', mark('take off')),
    _one('G', b'G', 'land', mark('land')), _one('R', b'R', 'record_start', mark('record a demonstration')),
    _one('S', b'S', 'record_stop', mark('stop recording')), _one('D', b'D', 'record_discard', mark('discard the recording')),
    _one('?', b'?', 'help', mark('all keys'), often=True),
    KeyBinding('q', {b'q': 'quit', b'\x04': 'quit'}, mark('leave'), often=True),
)
SEQUENCES: Mapping[bytes, str] = MappingProxyType({typed: meant for key in KEYS for typed, meant in key.typed.items()})


def help_text(words: Translator, width: int = 26) -> str:
    """All keys, one a line."""
    return '\n'.join(f'  {key.shown:<{width}}{words.t(key.text)}' for key in KEYS)


def decode(data: bytes) -> tuple[list[str], bytes]:
    """What was meant by what a terminal sent, and the start of a sequence that is not whole yet; other bytes are dropped."""
    meant: list[str] = []
    longest_first = sorted(SEQUENCES, key=len, reverse=True)
    while data:
        found = next((sequence for sequence in longest_first if data.startswith(sequence)), None)
        if found is not None:
            meant.append(SEQUENCES[found])
            data = data[len(found):]
        elif len(data) < len(longest_first[0]) and any(sequence.startswith(data) for sequence in SEQUENCES):
            return meant, data
        else:
            data = data[1:]
    return meant, b''
