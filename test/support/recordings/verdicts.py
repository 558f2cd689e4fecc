"""Bags that are malformed in every way known here, given to the commands that read them: one clear verdict each."""

from __future__ import annotations

import contextlib
import copy
import io
import json
import re
import resource
import shutil
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from advise_ros.commands import discretise, replay
from advise_ros.recording.gridfile import grid_to_mapping
from advise_ros.replay import learning
from support.promises.ledger import Row, row
from support.session_bag import GRID, SessionBag, session_bag

CHUNK_BYTES = 4000
MEMORY_LIMIT_MB = 64.0
# Of this many trials, one is a truncation and the others are flips; those by hand come on top.
ONE_IN = 6
BYTE_VALUES = 256
MAGIC, PREFIX, CHUNK = b'\x89MCAP0\r\n', 9, 6

Spoil = Callable[[Path, SessionBag], Path]


def verdicts(folder: Path, rng: np.random.Generator, trials: int) -> list[Row]:
    """Truncations, flips and what is made by hand: how many got no clear verdict, and how much memory that took."""
    learning.learn = cache(learning.learn)  # Pure, and asked the same again and again.
    (folder / 'grid.yaml').write_text(json.dumps({'grid': grid_to_mapping(GRID)}))
    wrong, unclear, growth_mb = [], [], []
    for name, bag in malformed(folder, rng, trials):
        before_mb = _most_memory_mb()
        problem = verdict(bag, folder / 'grid.yaml')
        wrong += [f'{name}: {problem}'] if problem else []
        unclear.append(float(bool(problem)))
        growth_mb.append(_most_memory_mb() - before_mb)
    growth_mb[0] = 0.0  # That of loading the learner.
    return [
        row(('reading', 'malformed bags', 'without one clear verdict'), unclear, 0.0, wrong),
        row(('reading', 'malformed bags', 'megabytes that the process grew by'), growth_mb, MEMORY_LIMIT_MB),
    ]


def _most_memory_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def verdict(bag: Path, grid: Path) -> str:
    """What is wrong with the verdicts of replay and discretise on a bag, '' if nothing."""
    for run, arguments in ((replay.run, [str(bag)]), (discretise.run, [str(bag), '--grid', str(grid)])):
        problem = _problem(run, arguments)
        if problem:
            return f'{run.__module__}: {problem}'
    return ''


def _problem(run: Callable[[Sequence[str]], int], arguments: list[str]) -> str:
    out, err = io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = run(arguments)
    except BaseException as problem:  # noqa: BLE001  that is what is looked for
        return f'{type(problem).__name__}: {problem}'
    errors = err.getvalue().splitlines()
    if 'please report it' in err.getvalue() or (code == 2) != bool(errors) or len(errors) > 1:
        return f'exit code {code} with {len(errors)} lines: {" | ".join(errors)}'
    return '' if code in (0, 1, 2) and (errors or out.getvalue().strip()) else f'exit code {code} and not a word'


# -- what is malformed -----------------------------------------------------------------------------
def malformed(folder: Path, rng: np.random.Generator, trials: int) -> Iterator[tuple[str, Path]]:
    """Name and path of one bag after the other; each takes the place of the one before."""
    bag = session_bag()
    whole = bag.write(folder / 'whole', CHUNK_BYTES)
    data = (whole / 'whole_0.mcap').read_bytes()
    for name, spoil in BY_HAND.items():
        shutil.rmtree(folder / 'bag', ignore_errors=True)
        yield name, spoil(folder / 'bag', copy.deepcopy(bag))
    bare = folder / 'bare.mcap'
    for number in range(max(1, trials // ONE_IN)):
        length = int(len(data) * number / max(1, trials // ONE_IN))
        bare.write_bytes(data[:length])
        yield f'cut off after {length} bytes', bare
    for _ in range(trials - trials // ONE_IN):
        spoilt, at = bytearray(data), int(rng.integers(len(data)))
        spoilt[at] ^= int(rng.integers(1, BYTE_VALUES))
        bare.write_bytes(spoilt)
        yield f'byte {at} is {spoilt[at]}', bare


def _file(bag: Path) -> Path:
    return bag / f'{bag.name}_0.mcap'


def no_metadata(bag: Path, session: SessionBag) -> Path:
    (session.write(bag) / 'metadata.yaml').unlink()
    return bag


def no_yaml(bag: Path, session: SessionBag) -> Path:
    (session.write(bag) / 'metadata.yaml').write_bytes(b'\xff\xfe{[')
    return bag


def _lie(bag: Path, session: SessionBag, pattern: str, words: str) -> Path:
    file = session.write(bag) / 'metadata.yaml'
    file.write_text(re.sub(pattern, words, file.read_text()))
    return bag


def other_count(bag: Path, session: SessionBag) -> Path:
    return _lie(bag, session, r'message_count: \d+', 'message_count: 5')


def other_storage(bag: Path, session: SessionBag) -> Path:
    return _lie(bag, session, 'storage_identifier: mcap', 'storage_identifier: sqlite3')


def other_file(bag: Path, session: SessionBag) -> Path:
    return _lie(bag, session, r'bag_0\.mcap', '../../../etc/passwd')


def said_to_be_compressed(bag: Path, session: SessionBag) -> Path:
    return _lie(bag, session, "compression_mode: ''", 'compression_mode: file')


def two_bags_in_one_directory(bag: Path, session: SessionBag) -> Path:
    session.write(bag)
    shutil.copy(_file(session_bag(2).write(bag.with_name('other'))), bag / 'other_0.mcap')
    shutil.rmtree(bag.with_name('other'))
    return bag


def two_files_glued_together(bag: Path, session: SessionBag) -> Path:
    file = _file(session.write(bag))
    file.write_bytes(file.read_bytes() * 2)
    return bag


def two_bags_as_parts_of_one(bag: Path, session: SessionBag) -> Path:
    shutil.copy(_file(session.write(bag)), bag / 'bag_1.mcap')
    return bag


def clock_that_goes_backward(bag: Path, session: SessionBag) -> Path:
    _stamps(session, lambda index, stamp_ns: 10**12 - stamp_ns)
    return session.write(bag)


def clock_that_jumps_back(bag: Path, session: SessionBag) -> Path:
    _stamps(session, lambda index, stamp_ns: stamp_ns - (index > 300) * 9 * 10**9)
    return session.write(bag)


def one_stamp_for_all(bag: Path, session: SessionBag) -> Path:
    _stamps(session, lambda index, stamp_ns: 7)
    return session.write(bag)


def each_stamp_twice(bag: Path, session: SessionBag) -> Path:
    session.entries = [entry for entry in session.entries for _ in range(2)]
    return session.write(bag)


def no_stamps(bag: Path, session: SessionBag) -> Path:
    _stamps(session, lambda index, stamp_ns: 0)
    return session.write(bag)


def another_grid(bag: Path, session: SessionBag) -> Path:
    """One demonstration on a grid that the others are not on."""
    session.entries[session.where('/demonstration')[0]][2].grid.info.width = 2
    return session.write(bag)


def no_grid(bag: Path, session: SessionBag) -> Path:
    for topic in ('/demonstration', '/advise/policy'):
        for index in session.where(topic):
            session.entries[index][2].grid.info.width = 0
    return session.write(bag)


def a_policy_for_fewer_states(bag: Path, session: SessionBag) -> Path:
    for index in session.where('/advise/policy'):
        session.entries[index][2].greedy = [0, 1]
    return session.write(bag)


def numbers_that_are_none(bag: Path, session: SessionBag) -> Path:
    for index in session.where('/pose'):
        session.entries[index][2].pose.position.x = float('nan')
    return session.write(bag)


def wrong_schema(bag: Path, session: SessionBag) -> Path:
    """Definitions by the right names that say something else."""
    return _replaced(bag, session, (b'float64 x\n', b'float32 x\n'), (b'uint32[] states', b'uint64[] states'))


def schema_that_is_none(bag: Path, session: SessionBag) -> Path:
    return _replaced(bag, session, (b'float64 x\n', b'fl at64 \xff\n'), (b'uint32[] states', b'[[[[[[[] states'))


def parameters_that_are_none(bag: Path, session: SessionBag) -> Path:
    return _replaced(bag, session, (b'0.95', b'0.9x'))


def frames_without_end(bag: Path, session: SessionBag) -> Path:
    """Lengths of strings that reach beyond the message."""
    return _replaced(bag, session, (b'\4\0\0\0map\0', b'\xff\xff\xff\x7fmap\0'))


def _replaced(bag: Path, session: SessionBag, *pairs: tuple[bytes, bytes]) -> Path:
    """Other bytes in a file without compression and checksums: it is read as if it were meant so."""
    file = _file(session.write(bag, compression='none'))
    data = file.read_bytes()
    for old, new in pairs:
        data = data.replace(old, new)
    file.write_bytes(_without_checksums(data))
    return bag


def _without_checksums(data: bytes) -> bytes:
    """A checksum of 0 means none: MCAP's chunk records have it behind start, end and size."""
    out, at = bytearray(data), len(MAGIC)
    while at < len(out) - PREFIX:
        opcode, length = out[at], int.from_bytes(out[at + 1 : at + PREFIX], 'little')
        if opcode == CHUNK:
            out[at + PREFIX + 24 : at + PREFIX + 28] = bytes(4)
        at += PREFIX + length
    return bytes(out)


def nothing_but_a_beginning(bag: Path, session: SessionBag) -> Path:
    file = _file(session.write(bag))
    file.write_bytes(b'\x89MCAP0\r\n')
    return bag


def a_size_beyond_all_bounds(bag: Path, session: SessionBag) -> Path:
    file = _file(session.write(bag, CHUNK_BYTES))
    data = bytearray(file.read_bytes())
    at = data.index(b'zstd') - 16  # The chunk's uncompressed size.
    data[at : at + 8] = (2**62).to_bytes(8, 'little')
    file.write_bytes(data)
    return bag


def _stamps(session: SessionBag, change: Callable[[int, int], int]) -> None:
    """Other header stamps and log times."""
    entries = []
    for index, (topic, log_ns, message) in enumerate(session.entries):
        stamp = message.header.stamp
        stamp.sec, stamp.nanosec = divmod(change(index, stamp.sec * 10**9 + stamp.nanosec), 10**9)
        entries.append((topic, change(index, log_ns), message))
    session.entries = entries


BY_HAND: dict[str, Spoil] = {
    spoil.__name__: spoil
    for spoil in (
        no_metadata, no_yaml, other_count, other_storage, other_file, said_to_be_compressed, two_bags_in_one_directory,
        two_files_glued_together, two_bags_as_parts_of_one, clock_that_goes_backward, clock_that_jumps_back,
        one_stamp_for_all, each_stamp_twice, no_stamps, another_grid, no_grid, a_policy_for_fewer_states,
        numbers_that_are_none, wrong_schema, schema_that_is_none, parameters_that_are_none, frames_without_end,
        nothing_but_a_beginning, a_size_beyond_all_bounds,
    )
}
