"""Recorders and learners that are killed, and disks that are full."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from mcap.records import Channel, Message

from advise_ros.recording.recover import Salvage
from advise_ros.recording.repair import recover
from advise_ros.recording.sessionfile import SessionFile
from advise_ros.ros import qos
from support.graph import Graph
from support.learning import ROUND_TRIP
from support.processes import Process, executable, ros_arguments
from support.promises.ledger import Row, row
from support.promises.rig import private_graph

RATE_HZ = 100.0
KILL_AFTER_S = (0.3, 2.5)
LIMIT_S = 1.0
STAMP_AT = 4
TMPFS_BYTES = 2**20


class Numbered:
    """Publishes poses whose stamps are their numbers, and knows when it published each (steady time)."""

    def __init__(self, graph: Graph, rate_hz: float) -> None:
        self.sent_s: list[float] = []
        self.longest_call_s = 0.0
        self._publisher = graph.node.create_publisher(PoseStamped, 'pose', qos.SENSOR)
        self._period_s = 1.0 / rate_hz
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        message = PoseStamped()
        message.header.frame_id = 'map'
        next_s = time.monotonic()
        while not self._over.wait(max(0.0, next_s - time.monotonic())):
            message.header.stamp.sec = len(self.sent_s)
            message.pose.position.x = 0.1 * len(self.sent_s)
            begun_s = time.monotonic()
            self.sent_s.append(begun_s)
            self._publisher.publish(message)
            self.longest_call_s = max(self.longest_call_s, time.monotonic() - begun_s)
            next_s += self._period_s

    def __enter__(self) -> Numbered:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        self._over.set()
        self._thread.join()


def start(graph: Graph, bag: Path, *prefix: str, **params: object) -> Process:
    """A logger with its default topics."""
    arguments = ros_arguments({'bag': str(bag), **params}, {}, '')
    return graph.start_command('logger', [*prefix, executable('logger'), *arguments])


def numbers(file: Path) -> list[int]:
    """Of the poses that are whole in a file."""
    found, topics = [], {}
    with Salvage(file) as salvage:
        for record in salvage.records():
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message) and topics[record.channel_id] == '/pose':
                found.append(int.from_bytes(record.data[STAMP_AT : STAMP_AT + 4], 'little'))
    return found


# -- killed ----------------------------------------------------------------------------------------
def kills(folder: Path, rng: np.random.Generator, trials: int) -> list[Row]:
    """SIGKILL at a random moment of a recording; the age of the oldest message that is missing."""
    lost_s, broken = [], []
    with private_graph() as graph, Numbered(graph, RATE_HZ) as poses:
        for trial in range(trials):
            bag = folder / f'killed{trial}'
            logger = start(graph, bag)
            graph.wait_until(lambda: recorded(bag), what='the logger to write its first pose')  # noqa: B023  called at once
            time.sleep(float(rng.uniform(*KILL_AFTER_S)))
            logger.popen.kill()
            killed_s = time.monotonic()
            logger.kill()
            found = numbers(next(bag.glob('*.mcap')))
            if found != list(range(found[0], found[-1] + 1)):
                broken.append(f'kill {trial}: poses are missing in the middle')
            lost_s.append(killed_s - poses.sent_s[found[-1] + 1] if len(poses.sent_s) > found[-1] + 1 else 0.0)
            if recover(bag).n_messages < len(found):
                broken.append(f'kill {trial}: recover finds less')
    return [row(('recording', 'logger killed (-9)', 'seconds lost'), lost_s, LIMIT_S, broken)]


def recorded(bag: Path) -> bool:
    """Some pose is in the file."""
    files = list(bag.glob('*.mcap'))
    return bool(files) and bool(numbers(files[0]))


# -- answers ---------------------------------------------------------------------------------------
WRITER = """
import sys
from advise_ros.recording.sessionfile import SessionFile
from support.learning import ROUND_TRIP, record
file = SessionFile(sys.argv[1], ROUND_TRIP)
number = len(file.loaded.entries)
while True:
    number += 1
    file.append_advice(record(number, (1,), (0,), (2,)), number)
    print(number, flush=True)
"""


def answers(folder: Path, rng: np.random.Generator, trials: int) -> list[Row]:
    """SIGKILL while answers are accepted: each that was acknowledged is there when the file is opened again."""
    path = folder / 'session.jsonl'
    lost = []
    env = {**os.environ, 'PYTHONPATH': str(Path(__file__).parents[2])}
    for _ in range(trials):
        with subprocess.Popen([sys.executable, '-c', WRITER, str(path)], stdout=subprocess.PIPE, text=True, env=env) as child:
            assert child.stdout is not None
            acknowledged = int(child.stdout.readline())
            time.sleep(float(rng.uniform(0.0, 0.2)))
            child.kill()
            acknowledged = max([acknowledged, *(int(line) for line in child.stdout if line.endswith('\n'))])
        file = SessionFile(path, ROUND_TRIP)
        kept = {entry.record.advice_id for entry in file.loaded.entries}
        file.close()
        lost.append(float(len(set(range(1, acknowledged + 1)) - kept)))
    return [row(('answers', 'their writer killed (-9)', 'acknowledged answers lost'), lost, 0.0)]


# -- a full disk -----------------------------------------------------------------------------------
@contextmanager
def small_disk(folder: Path) -> Iterator[tuple[Path, list[str], str]]:
    """A place with a megabyte of room, the words to start a process with, and what it is."""
    mount = folder / 'disk'
    mount.mkdir()
    mounted = subprocess.run(
        ['mount', '-t', 'tmpfs', '-o', f'size={TMPFS_BYTES}', 'tmpfs', str(mount)], check=False, capture_output=True,
    ).returncode == 0  # fmt: skip
    if not mounted:  # Only root may: a limit on the size of files says no in the same place.
        blocks = TMPFS_BYTES // 512
        yield mount, ['sh', '-c', f'ulimit -f {blocks}; exec "$@"', 'sh'], 'no tmpfs allowed here: a limit on the size of files'
        return
    try:
        yield mount, [], 'tmpfs of 1 MB'
    finally:
        subprocess.run(['umount', str(mount)], check=True)


def full_disk(folder: Path, rng: np.random.Generator, trials: int) -> list[Row]:
    """Recorded until nothing fits any more: one alarm, the graph goes on, and what was written can be recovered."""
    alarms, broken, kinds = [], [], set()
    for trial in range(trials):
        place = folder / f'full{trial}'
        place.mkdir()
        with small_disk(place) as (disk, prefix, kind), private_graph() as graph:
            kinds.add(kind)
            heard = graph.listen('/diagnostics', DiagnosticArray)
            with Numbered(graph, 4000.0) as poses:
                logger = start(graph, disk / 'bag', *prefix, compression='none', min_free_mib=0)
                graph.wait_until(lambda: errors(heard), what='an alarm')  # noqa: B023  called at once
                sent = len(poses.sent_s)
                graph.wait_until(lambda: len(poses.sent_s) > sent + 1000, what='the poses to go on')  # noqa: B023
            alarms.append(float(len(errors(heard))))
            if not logger.running:
                broken.append(f'trial {trial}: the logger has ended')
            if sum('stopped: ' in line for line in logger.err) != 1:
                broken.append(f'trial {trial}: not told once')
            logger.terminate()
            n_messages = recover(disk / 'bag', place / 'recovered').n_messages
            if n_messages < 1000:
                broken.append(f'trial {trial}: {n_messages} messages recovered from a megabyte')
    return [row(('recording', f'full disk ({", ".join(kinds)})', 'alarms'), alarms, 1.0, broken)]


def errors(heard: list[DiagnosticArray]) -> set[str]:
    """Alarms of the logger; one that is repeated counts once."""
    said = (status for array in heard for status in array.status)
    return {status.message for status in said if status.level == DiagnosticStatus.ERROR and status.name == '/logger'}
