"""Keys of a terminal, and the velocity that they ask for."""

from __future__ import annotations

from enum import Enum

from advise_ros.core.grid.grid import ACTION_STEP, Action
from advise_ros.core.units import ZERO, Vector


class Key(Enum):
    """What a key means to a pilot."""

    NORTH = 'north'
    EAST = 'east'
    SOUTH = 'south'
    WEST = 'west'
    UP = 'up'
    DOWN = 'down'
    HOLD = 'hold'
    TAKEOFF = 'takeoff'
    LAND = 'land'
    RECORD = 'record'
    QUIT = 'quit'


# Arrow keys come as ESC [ A or, in application mode, as ESC O A; page keys as ESC [ 5 ~.
SEQUENCES = {
    **{b'\x1b' + lead + letter: key for lead in (b'[', b'O') for letter, key in (
        (b'A', Key.NORTH), (b'B', Key.SOUTH), (b'C', Key.EAST), (b'D', Key.WEST),
    )},
    b'\x1b[5~': Key.UP, b'\x1b[6~': Key.DOWN, b'w': Key.UP, b's': Key.DOWN, b' ': Key.HOLD,
    b't': Key.TAKEOFF, b'l': Key.LAND, b'r': Key.RECORD, b'q': Key.QUIT,
}
MOTIONS = (Key.NORTH, Key.EAST, Key.SOUTH, Key.WEST, Key.UP, Key.DOWN)


def decode(data: bytes) -> tuple[list[Key], bytes]:
    """Keys in what a terminal sent, and the start of a sequence that is not whole yet; other bytes are dropped."""
    keys: list[Key] = []
    while data:
        found = next((sequence for sequence in SEQUENCES if data.startswith(sequence)), None)
        if found is not None:
            keys.append(SEQUENCES[found])
            data = data[len(found):]
        elif any(sequence.startswith(data) for sequence in SEQUENCES):
            return keys, data
        else:
            data = data[1:]
    return keys, b''


class Stick:
    """The last motion key, until it is let go: a terminal sends presses and repeats only, so releasing is a time-out.

    Args:
        speed_m_s, climb_m_s: while a key is held.
        timeout_s: a key counts as held this long after its last press or repeat.
    """

    def __init__(self, speed_m_s: float, climb_m_s: float, timeout_s: float) -> None:
        self._speed_m_s, self._climb_m_s, self._timeout_s = speed_m_s, climb_m_s, timeout_s
        self._key: Key | None = None
        self._at_s = 0.0

    def press(self, key: Key, now_s: float) -> None:
        """Take a key; anything but a motion lets go.

        Args:
            key: that was pressed or repeated.
            now_s: steady time.
        """
        self._key, self._at_s = key if key in MOTIONS else None, now_s

    def held(self, now_s: float) -> Key | None:
        """The motion key that is held.

        Args:
            now_s: steady time.
        """
        return self._key if now_s - self._at_s <= self._timeout_s else None

    def velocity(self, now_s: float) -> Vector:
        """(east, north, up) in m/s in the map frame.

        Args:
            now_s: steady time.
        """
        key = self.held(now_s)
        if key is None:
            return ZERO
        if key in (Key.UP, Key.DOWN):
            return (0.0, 0.0, self._climb_m_s if key is Key.UP else -self._climb_m_s)
        east, north = ACTION_STEP[Action[key.name]]
        return (east * self._speed_m_s, north * self._speed_m_s, 0.0)
