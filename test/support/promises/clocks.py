"""The wall clock is set by a minute in mid-flight: control goes on."""

from __future__ import annotations

import mmap
import shutil
import struct
import subprocess
import time
from pathlib import Path

import numpy as np

from advise_msgs.msg import FlightStatus
from support.promises.book import Book, Measure
from support.promises.rig import Rig, Settings, flying

JUMP_S = 60
GAP_LIMIT_S = 0.1
WATCH_S = 1.2
TROUBLES = {0: 'wall clock left alone', JUMP_S: f'wall clock of all nodes +{JUMP_S} s', -JUMP_S: f'the same -{JUMP_S} s'}
NOTE = 'clocks are set inside of the processes, by a preloaded library'
SOURCE = Path(__file__).with_name('set_clock.c')


class Clocks:
    """Wall clocks of processes that can be set."""

    def __init__(self, folder: Path) -> None:
        library = folder / 'set_clock.so'
        compiler = shutil.which('cc') or 'c++'
        subprocess.run([compiler, '-shared', '-fPIC', '-O2', '-o', str(library), str(SOURCE), '-ldl'], check=True)
        path = folder / 'clock_offset'
        path.write_bytes(bytes(8))
        self._file = path.open('r+b')
        self._shared = mmap.mmap(self._file.fileno(), 8)
        self.env = {'LD_PRELOAD': str(library), 'SET_CLOCK_FILE': str(path)}

    def set(self, offset_s: int) -> None:
        """Set all of them at once."""
        self._shared[:] = struct.pack('=q', offset_s * 1_000_000_000)

    def close(self) -> None:
        self._shared.close()
        self._file.close()


def run(folder: Path, rng: np.random.Generator, book: Book) -> None:
    """Set the clocks forward and back in a flight of their own, again and again."""
    clocks = Clocks(folder)
    try:
        with flying(folder, rng, Settings(env=clocks.env)) as rig:
            for _ in book.rounds():
                set_them(rig, book, clocks)
    finally:
        clocks.close()


def set_them(rig: Rig, book: Book, clocks: Clocks) -> None:
    """Set all clocks forward and back again; first without setting them, for comparison."""
    offset_s = 0
    for jump_s, trouble in TROUBLES.items():
        offset_s += jump_s
        gap_s = _gap(rig, clocks, offset_s)
        book.add(Measure('control goes on', trouble, 'longest gap, s', gap_s, GAP_LIMIT_S, note=NOTE))


def _gap(rig: Rig, clocks: Clocks, offset_s: int) -> float:
    """Longest gap in control about the moment of setting; a route that ends meanwhile is flown again."""
    while True:
        rig.fly()
        rig.pause(0.2)
        flight = rig.flights[-1].flight_id
        at_s = time.monotonic()
        clocks.set(offset_s)
        time.sleep(WATCH_S)
        last = rig.flights[-1]
        if last.phase != FlightStatus.SUCCEEDED or last.flight_id != flight:
            return rig.longest_gap(at_s, at_s + WATCH_S)


