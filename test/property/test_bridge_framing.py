"""Cutting bytes into messages: good frames survive whatever stands around them."""

from __future__ import annotations

import random

from hypothesis import given, settings
from hypothesis import strategies as st

from advise_ros.mavlink.framing import LONGEST_FRAME, Framer
from advise_ros.mavlink.messages import dialect


def frames(count: int) -> list[bytes]:
    """Distinct good frames; their payloads hold start bytes."""
    codec = dialect.MAVLink(None, 1, 1)
    out = []
    for i in range(count):
        codec.seq = i % 256
        out.append(bytes(dialect.MAVLink_local_position_ned_message(i, 1.0, 2.0, 3.0, -1.0, 0.5, 0.1).pack(codec)))
    return out


def times(messages: list[object]) -> list[int]:
    return [m.time_boot_ms for m in messages if m.get_type() == 'LOCAL_POSITION_NED']  # type: ignore[attr-defined]


garbage = st.binary(max_size=40) | st.just(b'\xfd') | st.just(b'\xfd\xff\x00\x00') | st.just(b'\xfe\xff\x00')


@settings(deadline=None)
@given(st.lists(garbage, min_size=1, max_size=20))
def test_every_good_frame_between_garbage_is_found_in_a_datagram(noise: list[bytes]) -> None:
    good = frames(len(noise))
    data = b''.join(part for pair in zip(noise, good, strict=True) for part in pair)
    assert times(Framer().datagram(data)) == list(range(len(noise)))


@settings(deadline=None)
@given(st.lists(garbage, min_size=1, max_size=20), st.lists(st.integers(1, 60), min_size=1, max_size=50))
def test_every_good_frame_between_garbage_is_found_in_a_stream(noise: list[bytes], cuts: list[int]) -> None:
    good = frames(len(noise))
    data = b''.join(part for pair in zip(noise, good, strict=True) for part in pair) + bytes(600)
    framer = Framer()
    found: list[int] = []
    at = 0
    for size in [*cuts, len(data)]:
        found += times(framer.stream(data[at:at + size]))
        at += size
    assert found == list(range(len(noise)))


@settings(deadline=None)
@given(st.binary(max_size=600))
def test_any_bytes_are_survived_and_forgotten_with_their_datagram(data: bytes) -> None:
    framer = Framer()
    framer.datagram(data)
    assert times(framer.datagram(frames(1)[0])) == [0]


def test_an_unknown_message_does_not_swallow_what_follows() -> None:
    unknown = bytes([0xFD, 200, 0, 0, 0, 1, 1, 0xFF, 0xFF, 0x7F])
    framer = Framer()
    assert times(framer.datagram(unknown + b''.join(frames(3)))) == [0, 1, 2]
    assert framer.bad_bytes == len(unknown)


def test_a_flipped_bit_costs_one_frame() -> None:
    three = frames(3)
    broken = bytearray(three[1])
    broken[14] ^= 1
    assert times(Framer().datagram(three[0] + bytes(broken) + three[2])) == [0, 2]


def test_none_of_a_million_random_bytes_is_accepted_and_nothing_is_hoarded() -> None:
    data = random.Random(5).randbytes(1_000_000)
    framer = Framer()
    assert [m for at in range(0, len(data), 1000) for m in framer.stream(data[at:at + 1000])] == []
    assert framer.waiting_bytes <= LONGEST_FRAME
    assert framer.bad_bytes + framer.waiting_bytes == len(data)


def test_start_bytes_and_likely_headers_are_survived() -> None:
    """Sixteen bits of checksum are no defence against who knows the headers; signing is."""
    rng = random.Random(6)
    start = [b'\xfd', b'\xfe', b'\xfd\x1c\x00\x00\x00\x01\x01\x20\x00\x00', b'\xfe\x1c\x00\x01\x01\x20', b'\xfd\xff\x01']
    framer = Framer()
    for _ in range(200):
        data = b''.join(rng.choice(start) + rng.randbytes(rng.randrange(20)) for _ in range(100))
        assert len(framer.stream(data)) <= 1
        assert framer.waiting_bytes <= LONGEST_FRAME
    assert times(framer.stream(bytes(LONGEST_FRAME) + frames(1)[0] + bytes(LONGEST_FRAME))) == [0]


def test_sound_frames_that_nobody_needs_are_no_garbage_and_not_handed_on() -> None:
    codec = dialect.MAVLink(None, 1, 1)
    other = bytes(dialect.MAVLink_vfr_hud_message(1.0, 2.0, 3, 4, 5.0, 6.0).pack(codec))
    framer = Framer()
    assert times(framer.datagram(other + frames(1)[0])) == [0]
    assert framer.bad_bytes == 0


def test_old_mavlink_is_heard_too() -> None:
    codec = dialect.MAVLink(None, 1, 1)
    old = bytes(dialect.MAVLink_local_position_ned_message(7, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0).pack(codec, force_mavlink1=True))
    assert times(Framer().datagram(b'\xfe\x09' + old)) == [7]
