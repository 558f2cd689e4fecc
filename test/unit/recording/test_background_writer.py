"""A bag written beside its owner: nobody waits for the disk, and what goes wrong there is found in one place."""

import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from advise_ros.recording import background
from advise_ros.recording.background import BackgroundWriter, BagEntry, WriteLimits
from advise_ros.recording.definitions import definition
from advise_ros.recording.messages import Bag
from advise_ros.recording.recover import is_whole
from advise_ros.recording.writer import BagWriter

TEXT = 'std_msgs/msg/String'
QUICK = WriteLimits(flush_s=0.05)
DATA = b'\0\1\0\0' + (8).to_bytes(4, 'little') + b'flying.\0'


def begin(folder: Path, limits: WriteLimits = QUICK) -> BackgroundWriter:
    writer = BackgroundWriter(BagWriter(folder / 'bag'), limits)
    writer.open_topic('/words', definition(TEXT), ())
    return writer


def entries(first: int, count: int) -> list[BagEntry]:
    return [BagEntry('/words', number, number, DATA) for number in range(first, first + count)]


def until(condition: Callable[[], object]) -> None:
    deadline = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_all_that_was_given_is_in_the_bag_in_order(tmp_path: Path) -> None:
    writer = begin(tmp_path)
    for first in range(0, 1000, 100):
        writer.write(entries(first, 100))
    writer.add_record('platform', {'numpy': '2'})
    writer.close()
    assert writer.problem is None and writer.counts == {'/words': 1000} and writer.dropped == 0
    bag = Bag(tmp_path / 'bag', [TEXT])
    assert [message.log_time_ns for message in bag.messages] == list(range(1000)) and bag.gaps == []


def test_counts_are_of_what_outlives_this_process(tmp_path: Path) -> None:
    writer = begin(tmp_path)
    writer.write(entries(0, 10))
    until(lambda: writer.counts.get('/words') == 10)
    assert not is_whole(tmp_path / 'bag' / 'bag_0.mcap')
    assert len(Bag(tmp_path / 'bag', [TEXT]).messages) == 10
    writer.close()


def test_a_disk_that_fails_to_sync_ends_the_recording_with_its_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = begin(tmp_path)
    writer.write(entries(0, 10))
    until(lambda: writer.counts.get('/words') == 10)

    def broken(handle: int) -> None:
        raise OSError(5, 'Input/output error')

    monkeypatch.setattr(background.os, 'fsync', broken)
    until(lambda: writer.problem)
    assert writer.problem == 'Input/output error'
    writer.write(entries(10, 10))
    writer.close()
    assert len(Bag(tmp_path / 'bag', [TEXT]).messages) == 10


def test_nobody_waits_for_a_slow_disk_and_what_it_is_too_slow_for_is_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:
    go_on = threading.Event()
    writer = begin(tmp_path, WriteLimits(flush_s=60.0))
    write = BagWriter.write

    def slow(bag: BagWriter, *given: object) -> None:
        go_on.wait()
        write(bag, *given)

    monkeypatch.setattr(BagWriter, 'write', slow)
    monkeypatch.setattr(background, 'MAX_WAITING_BYTES', 100 * len(DATA))
    for first in range(0, 300, 10):
        writer.write(entries(first, 10))
    assert writer.dropped == 300 - 110
    go_on.set()
    writer.close()
    assert [message.log_time_ns for message in Bag(tmp_path / 'bag', [TEXT]).messages] == list(range(110))


def n_handles() -> int:
    return sum(1 for _ in Path('/proc/self/fd').iterdir())


def test_no_handle_is_left_open(tmp_path: Path) -> None:
    before = n_handles()
    writer = begin(tmp_path, WriteLimits(flush_s=0.05, split_bytes=1))
    for first in range(3):
        writer.write(entries(10 * first, 10))
        until(lambda done=10 * first + 10: writer.counts.get('/words') == done)
    writer.close()
    assert len(list((tmp_path / 'bag').glob('*.mcap'))) >= 3
    until(lambda: n_handles() <= before)


def test_a_mistake_in_the_writer_ends_the_recording_with_its_words(tmp_path: Path) -> None:
    writer = begin(tmp_path)
    writer.write([BagEntry('/never_opened', 1, 1, DATA)])
    until(lambda: writer.problem)
    assert writer.problem == "KeyError: '/never_opened'"
    writer.write(entries(0, 10))
    writer.close()
    assert writer.counts == {}
