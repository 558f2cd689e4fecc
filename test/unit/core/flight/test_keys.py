"""Keys of a terminal."""

import pytest

from advise_ros.core.flight.keyboard import SEQUENCES, Key, Stick, decode


@pytest.mark.parametrize(('typed', 'keys'), [
    (b'\x1b[A\x1b[B\x1b[C\x1b[D', [Key.NORTH, Key.SOUTH, Key.EAST, Key.WEST]),
    (b'\x1bOA\x1bOC', [Key.NORTH, Key.EAST]),
    (b'w\x1b[5~s\x1b[6~', [Key.UP, Key.UP, Key.DOWN, Key.DOWN]),
    (b'tlr q', [Key.TAKEOFF, Key.LAND, Key.RECORD, Key.HOLD, Key.QUIT]),
    (b'xyz\x1b[Hq', [Key.QUIT]),
    ('äß'.encode(), []),
    (b'', []),
])
def test_known_keys_are_found_and_the_rest_is_dropped(typed: bytes, keys: list[Key]) -> None:
    assert decode(typed) == (keys, b'')


@pytest.mark.parametrize('sequence', [s for s in SEQUENCES if len(s) > 1])
def test_a_sequence_cut_in_two_is_put_together(sequence: bytes) -> None:
    for cut in range(1, len(sequence)):
        keys, rest = decode(sequence[:cut])
        assert keys == []
        assert decode(rest + sequence[cut:]) == ([SEQUENCES[sequence]], b'')


@pytest.mark.parametrize(('key', 'velocity'), [
    (Key.NORTH, (0.0, 2.0, 0.0)), (Key.EAST, (2.0, 0.0, 0.0)), (Key.SOUTH, (0.0, -2.0, 0.0)), (Key.WEST, (-2.0, 0.0, 0.0)),
    (Key.UP, (0.0, 0.0, 0.5)), (Key.DOWN, (0.0, 0.0, -0.5)), (Key.HOLD, (0.0, 0.0, 0.0)), (Key.LAND, (0.0, 0.0, 0.0)),
])
def test_a_key_is_a_velocity_until_it_is_let_go(key: Key, velocity: tuple[float, float, float]) -> None:
    stick = Stick(2.0, 0.5, 0.6)
    stick.press(key, 10.0)
    assert stick.velocity(10.5) == velocity
    assert stick.velocity(10.7) == (0.0, 0.0, 0.0)


def test_any_other_key_lets_go() -> None:
    stick = Stick(2.0, 0.5, 0.6)
    stick.press(Key.NORTH, 10.0)
    stick.press(Key.RECORD, 10.1)
    assert stick.held(10.2) is None


def test_nothing_is_held_at_first() -> None:
    assert Stick(2.0, 0.5, 0.6).velocity(0.0) == (0.0, 0.0, 0.0)
