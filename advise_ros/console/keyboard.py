"""Keys of a terminal that answers questions: what a person types, and what it means."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from advise_ros.core.grid.grid import Action

# A terminal sends the arrows as ESC [ A or ESC O A, with Shift as ESC [ 1 ; 2 A; for terminals that keep Shift to
# themselves the letters h j k l do the same, capitals with Shift.
_ARROWS = (
    (b'A', b'k', Action.NORTH), (b'C', b'l', Action.EAST), (b'B', b'j', Action.SOUTH), (b'D', b'h', Action.WEST),
)
SEQUENCES: Mapping[bytes, str] = MappingProxyType({
    **{lead + arrow: f'prefer {action}' for arrow, _, action in _ARROWS for lead in (b'\x1b[', b'\x1bO')},
    **{b'\x1b[1;2' + arrow: f'avoid {action}' for arrow, _, action in _ARROWS},
    **{letter: f'prefer {action}' for _, letter, action in _ARROWS},
    **{letter.upper(): f'avoid {action}' for _, letter, action in _ARROWS},
    **{str(layer).encode(): f'layer {layer - 1}' for layer in range(1, 10)},
    b'y': 'option 0', b'n': 'option 1',
    b'\r': 'send', b'\n': 'send', b's': 'skip', b'u': 'unsure', b'm': 'mixed', b'o': 'others', b'\x7f': 'undo', b'\x08': 'undo',
    b' ': 'hold', b't': 'take back', b'f': 'fly', b'T': 'takeoff', b'G': 'land', b'R': 'record_start', b'S': 'record_stop',
    b'D': 'record_discard', b'x': 'mark', b'v': 'heat', b'r': 'replay', b'?': 'help', b'q': 'quit', b'\x04': 'quit',
})  # fmt: skip


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
