"""Signed links: unsigned, forged and replayed frames are refused, and nobody is locked out."""

from __future__ import annotations

from pathlib import Path

import pytest

from advise_ros.core.errors import InputError
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.framing import Framer
from advise_ros.mavlink.signing import LATEST, UNITS_A_SECOND, Encoder, SigningClock, Verifier, load_key

KEY, OTHER_KEY = bytes(range(32)), bytes(32)
NOW = 11 * 365 * 86_400 * UNITS_A_SECOND
HOUR = 3600 * UNITS_A_SECOND


def sender(key: bytes | None = KEY, at: int = NOW) -> Encoder:
    return Encoder(1, 1, key, SigningClock(at))


def receiver(at: int = NOW) -> tuple[Framer, Verifier, SigningClock]:
    clock = SigningClock(at)
    verifier = Verifier(KEY, clock)
    return Framer(verifier), verifier, clock


def heard(framer: Framer, *frames: bytes) -> int:
    return sum(len(framer.datagram(frame)) for frame in frames)


def beats(encoder: Encoder, count: int = 100) -> list[bytes]:
    return [encoder.frame(mav.heartbeat()) for _ in range(count)]


def forged(frame: bytes, at: int) -> bytes:
    """The frame with another time and a guessed hash."""
    return frame[:-12] + at.to_bytes(6, 'little') + b'\x00' * 6


def test_signed_frames_are_heard_and_all_others_refused() -> None:
    framer, verifier, _ = receiver()
    assert heard(framer, *beats(sender())) == 100
    for other, why in ((sender(None), 'not signed'), (sender(OTHER_KEY), 'another key')):
        assert heard(framer, *beats(other, 3)) == 0
        assert why in verifier.refusal
    v1 = bytes(mav.heartbeat().pack(mav.dialect.MAVLink(None, 1, 1), force_mavlink1=True))
    assert heard(framer, v1) == 0
    assert verifier.refused == 7


def test_replays_are_dropped_also_by_a_receiver_that_was_restarted() -> None:
    framer, verifier, _ = receiver()
    frames = beats(sender())
    assert heard(framer, *frames) == 100
    assert heard(framer, *frames) == 0
    assert 'came twice' in verifier.refusal
    later, verifier, _ = receiver(NOW + HOUR)
    assert heard(later, *frames) == 0
    assert 'a replay' in verifier.refusal


def test_a_forged_time_in_the_far_future_locks_nobody_out() -> None:
    framer, _, clock = receiver()
    true = sender()
    first = true.frame(mav.heartbeat())
    assert heard(framer, first, *(forged(first, at) for at in (LATEST, NOW + HOUR))) == 1
    assert heard(framer, *beats(true)) == 100
    assert clock.stamp() < NOW + HOUR


def test_a_sender_whose_clock_is_ahead_locks_no_other_link_out() -> None:
    framer, _, _ = receiver()
    ahead = sender(at=NOW + HOUR)
    assert heard(framer, *beats(ahead, 10)) == 10
    other_link = Encoder(2, 1, KEY, SigningClock(NOW))
    assert heard(framer, *beats(other_link)) == 100


def test_what_we_send_is_never_behind_what_we_heard() -> None:
    """An autopilot that took over a time an hour ahead refuses new links with the true one."""
    framer, _, clock = receiver()
    assert heard(framer, *beats(sender(at=NOW + HOUR), 5)) == 5
    theirs, _, _ = receiver(NOW + HOUR)
    assert heard(theirs, *beats(Encoder(1, 191, KEY, clock))) == 100
    stamps = [clock.stamp() for _ in range(100)]
    assert stamps == sorted(set(stamps))


def test_the_memory_of_links_is_bounded() -> None:
    framer, verifier, _ = receiver()
    for system in range(1, 200):
        assert heard(framer, Encoder(system, 1, KEY, SigningClock(NOW)).frame(mav.heartbeat())) == 1
    assert len(verifier._newest) <= 64


def test_signed_frames_with_garbage_between_come_through_a_stream() -> None:
    framer, _, _ = receiver()
    data = b''.join(frame + b'\xfd\x09\x01garbage' for frame in beats(sender(), 20))
    found = sum(len(framer.stream(data[at:at + 7])) for at in range(0, len(data), 7)) + len(framer.stream(bytes(300)))
    assert found == 20


def write(path: Path, data: bytes, mode: int = 0o600) -> str:
    path.write_bytes(data)
    path.chmod(mode)
    return str(path)


@pytest.mark.parametrize('data', [KEY, KEY.hex().encode(), KEY.hex().upper().encode() + b'\n'])
def test_a_key_file_holds_bytes_or_hexadecimal_digits(tmp_path: Path, data: bytes) -> None:
    assert load_key(write(tmp_path / 'key', data)) == KEY


@pytest.mark.parametrize('mode', [0o640, 0o604, 0o620, 0o666])
def test_a_key_that_others_may_read_or_write_is_refused(tmp_path: Path, mode: int) -> None:
    with pytest.raises(InputError, match=r'is open to others than its owner .*; chmod 600 it'):
        load_key(write(tmp_path / 'key', KEY, mode))


@pytest.mark.parametrize('data', [b'', b'secret', KEY[:-1], KEY.hex().encode() + b'00', b'\xff' * 64])
def test_what_is_no_key_is_told_with_the_remedy(tmp_path: Path, data: bytes) -> None:
    with pytest.raises(InputError, match=r'is neither 64 hexadecimal digits nor 32 bytes; make one by'):
        load_key(write(tmp_path / 'key', data))


def test_a_missing_key_and_a_pipe_in_its_place_are_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match='cannot be read: no such file'):
        load_key(str(tmp_path / 'none'))
    (tmp_path / 'directory').mkdir()
    with pytest.raises(InputError, match=r'cannot be read|is open to others'):
        load_key(str(tmp_path / 'directory'))
