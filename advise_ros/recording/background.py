"""A bag written by a thread of its own: no callback waits for compression or for the disk."""

from __future__ import annotations

import os
import queue
import shutil
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from rosbags.interfaces import Qos

from advise_ros.config import LoggerConfig
from advise_ros.recording.definitions import Definition
from advise_ros.recording.writer import BagWriter

# Part of the longest time unwritten after which the file is flushed: collecting and writing take the rest.
FLUSH_AT = 0.7
# Messages that wait for a disk that does not keep up; more are dropped, and counted.
MAX_WAITING_BYTES = 256 * 2**20
# A disk that answers later than this at the end is given up.
CLOSE_PATIENCE_S = 30.0
MIB = 2**20

Job = Callable[[], None]


class WriteLimits(NamedTuple):
    """When to write what; 0 where something is never due.

    Attributes:
        flush_s: longest time that a message stays unwritten.
        split_s: recorded time of one file.
        split_bytes: size of one file.
        free_bytes: the recording ends properly when less is free on the disk.
    """

    flush_s: float = LoggerConfig.flush_s
    split_s: float = LoggerConfig.split_s
    split_bytes: int = 0
    free_bytes: int = 0


class BagEntry(NamedTuple):
    """A message for the bag; its topic is opened before."""

    topic: str
    log_time_ns: int
    publish_time_ns: int
    data: bytes


class BackgroundWriter:
    """Owns a bag. Calls return at once; what goes wrong is found in `problem`.

    The file is flushed to the operating system in time, so that what was recorded outlives this process, and
    another thread brings it to the disk, so that it outlives the machine's power.

    Attributes:
        problem: why the recording has ended, in a few words; None while it goes on.
        counts: topic -> messages that were flushed.
        dropped: messages that the disk was too slow for.
    """

    def __init__(self, bag: BagWriter, limits: WriteLimits) -> None:
        self.problem: str | None = None
        self.counts: dict[str, int] = {}
        self.dropped = 0
        self._bag, self._limits = bag, limits
        self._topics: dict[str, int] = {}
        self._waiting_bytes = self._written_bytes = 0
        self._topics_written = 0
        self._jobs: queue.SimpleQueue[Job | None] = queue.SimpleQueue()
        self._disk = _DiskSync()
        self._thread = threading.Thread(target=self._run, name='writer', daemon=True)
        self._thread.start()

    # -- called by the owner -------------------------------------------------------------------
    def open_topic(self, topic: str, definition: Definition, qos: Sequence[Qos]) -> None:
        """Name a topic, once, before its first message."""
        self._put(partial(self._open, topic, definition, tuple(qos)))

    def write(self, entries: Sequence[BagEntry]) -> None:
        """Append messages in this order."""
        if self._waiting_bytes - self._written_bytes > MAX_WAITING_BYTES:
            self.dropped += len(entries)
            return
        self._waiting_bytes += sum(len(entry.data) for entry in entries)
        self._put(partial(self._write, entries))

    def add_record(self, name: str, values: Mapping[str, str]) -> None:
        """Append an MCAP metadata record."""
        self._put(partial(self._bag.add_record, name, dict(values)))

    def close(self) -> None:
        """Write what waits and finish the bag; `problem` says why it could not be."""
        self._jobs.put(None)
        self._thread.join(CLOSE_PATIENCE_S)
        if self._thread.is_alive():
            self.problem = self.problem or f'the disk has not answered for {CLOSE_PATIENCE_S:.0f} s'

    def _put(self, job: Job) -> None:
        if self.problem is None:
            self._jobs.put(job)

    # -- in the thread -------------------------------------------------------------------------
    def _run(self) -> None:
        try:
            self._work()
            self._bag.close()
            self.counts = self._bag.counts
        except Exception as problem:  # noqa: BLE001  a writer that ended without a word would look like one that records
            self.problem = getattr(problem, 'strerror', None) or f'{type(problem).__name__}: {problem}'
            self._bag.abandon()
        finally:
            self._disk.close()

    def _work(self) -> None:
        """Until `close` is called or the disk is nearly full."""
        period_s = FLUSH_AT * self._limits.flush_s
        flush_s = time.monotonic() + period_s
        while self.problem is None:
            try:
                job = self._jobs.get(timeout=max(0.0, flush_s - time.monotonic()))
                if job is None:
                    return
                job()
            except queue.Empty:
                pass
            if time.monotonic() >= flush_s:
                self._flush()
                flush_s = time.monotonic() + period_s

    def _open(self, topic: str, definition: Definition, qos: Sequence[Qos]) -> None:
        self._topics[topic] = self._bag.add_topic(topic, definition, qos)

    def _write(self, entries: Sequence[BagEntry]) -> None:
        for topic, log_time_ns, publish_time_ns, data in entries:
            self._bag.write(self._topics[topic], log_time_ns, publish_time_ns, data)
            self._written_bytes += len(data)

    def _flush(self) -> None:
        self._bag.flush()
        self.counts = self._bag.counts
        self._disk.sync(self._bag.fileno)
        if len(self._topics) != self._topics_written:
            self._bag.write_metadata_file()
            self._topics_written = len(self._topics)
        limits = self._limits
        if (0 < limits.split_s * 1e9 <= self._bag.duration_ns) or (0 < limits.split_bytes <= self._bag.size):
            self._bag.split()
        free = shutil.disk_usage(self._bag.directory).free
        if free < limits.free_bytes:
            self.problem = f'only {free // MIB} MiB are free on its disk, {limits.free_bytes // MIB} are to stay free'


class _DiskSync:
    """Brings files to the disk, one call at a time, in a thread that may wait for the disk."""

    def __init__(self) -> None:
        self._handles: queue.SimpleQueue[int | None] = queue.SimpleQueue()
        self._problem: OSError | None = None
        self._thread = threading.Thread(target=self._run, name='sync', daemon=True)
        self._thread.start()

    def sync(self, handle: int) -> None:
        """Have a file synced, which may be closed meanwhile; not now if the disk is busy with the last call.

        Raises:
            OSError: an earlier call failed.
        """
        if self._problem is not None:
            raise self._problem
        if self._handles.empty():
            self._handles.put(os.dup(handle))

    def close(self) -> None:
        self._handles.put(None)

    def _run(self) -> None:
        while (handle := self._handles.get()) is not None:
            try:
                os.fsync(handle)
            except OSError as problem:
                self._problem = problem
            finally:
                os.close(handle)
