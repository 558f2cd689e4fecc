"""Recording: processor time a message beside a bare raw subscription, loss, bytes a message.

    ./advise python benchmarks/recording.py [--rates 100 1000 5000] [--alone 10000 20000] [--seconds 10] [--runs 3] [--json FILE]

One process publishes numbered poses; /logger, with its default topics, records them while a bare subscription (rclpy,
raw, one callback that counts) hears the same ones, so both meet the same load. Processor time is that of all threads,
what they do beside the messages included, over the same stretch of time, by the poses sent. At the rates of --alone
the other is not there. Loss is what the bag lacks, bytes are the finished file by its messages. Intervals are 95 %
(Student's t over the runs).
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped
from mcap.records import Channel, Message
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rich.console import Console
from rich.table import Table
from scipy import stats

from advise_ros.recording.recover import Salvage
from advise_ros.ros import qos
from advise_ros.ros.cdr import to_cdr
from advise_ros.supervisor import executable, ros_arguments

TOPIC = 'pose'
# Of a pose in CDR: encapsulation, then seconds and nanoseconds of its stamp.
STAMP_AT = 4
PATIENCE_S = 60.0
SETTLE_S = 1.5


@dataclass(frozen=True)
class Trial:
    """One rate, one run; processor times in microseconds a pose, `bare_us` 0 when it was not there."""

    rate: float
    sent: int
    reached_hz: float
    recorded: int
    bare_received: int
    logger_us: float
    bare_us: float
    bytes_a_message: float


# -- the other processes ---------------------------------------------------------------------------
def publish(rate: float, count: int, readers: int) -> None:
    """Poses with their number as stamp, when a line comes in; tells the rate that was reached."""
    rclpy.init()
    node = rclpy.create_node('benchmark_publisher')
    publisher = node.create_publisher(PoseStamped, TOPIC, qos.SENSOR)
    message = PoseStamped()
    message.header.frame_id = 'map'
    data = bytearray(to_cdr(message))
    until = time.monotonic() + PATIENCE_S
    while publisher.get_subscription_count() < readers and time.monotonic() < until:
        time.sleep(0.05)
    print('ready', flush=True)
    sys.stdin.readline()
    rng = np.random.default_rng(0)
    walk = np.cumsum(rng.normal(0.0, 0.02, (count, 3)), axis=0)  # Positions that compress as a flight's do.
    begun = time.monotonic()
    for number in range(count):
        data[STAMP_AT : STAMP_AT + 4] = (number + 1).to_bytes(4, 'little')
        data[-56:-32] = walk[number].tobytes()
        publisher.publish(bytes(data))
        ahead_s = begun + number / rate - time.monotonic()
        if ahead_s > 0:
            time.sleep(ahead_s)
    print(count / (time.monotonic() - begun), flush=True)
    sys.stdin.readline()


def listen() -> None:
    """A bare raw subscription; prints how many it heard when it is interrupted."""
    rclpy.init()
    node = rclpy.create_node('benchmark_bare')
    heard = [0]

    def count(_: bytes) -> None:
        heard[0] += 1

    node.create_subscription(PoseStamped, TOPIC, count, qos.SENSOR_DEEP, raw=True)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        executor.spin()
    except (ExternalShutdownException, KeyboardInterrupt):
        print(heard[0], flush=True)


# -- one trial -------------------------------------------------------------------------------------
def cpu_ns(pid: int) -> int:
    """Processor time of all threads of a process."""
    return sum(int(task.read_text().split()[0]) for task in Path(f'/proc/{pid}/task').glob('*/schedstat'))


def start(*command: str) -> subprocess.Popen[str]:
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def last_line(process: subprocess.Popen[str], wanted: str = '') -> str:
    """The next line that can be ours; the middleware writes to stdout too."""
    assert process.stdout is not None
    for line in process.stdout:
        text = line.strip()
        if text == wanted or (not wanted and text.replace('.', '', 1).isdigit()):
            return text
    raise RuntimeError(f'{process.args} ended without a word')


def tell(process: subprocess.Popen[str]) -> None:
    assert process.stdin is not None
    process.stdin.write('\n')
    process.stdin.flush()


def trial(rate: float, seconds: float, *, beside: bool, folder: Path) -> Trial:
    """Record `rate * seconds` poses."""
    count = round(rate * seconds)
    bag = folder / 'bag'
    logger = start(str(executable('logger')), *ros_arguments({'bag': str(bag)}))
    bare = start(sys.executable, __file__, '--role', 'listen') if beside else None
    publisher = start(sys.executable, __file__, '--role', 'publish', '--rates', str(rate), '--count', str(count),
                      '--readers', str(1 + beside))
    last_line(publisher, 'ready')
    time.sleep(SETTLE_S)  # Discovery and start-up are over.
    pids = [process.pid for process in (logger, bare) if process is not None]
    before = [cpu_ns(pid) for pid in pids]
    tell(publisher)
    reached = float(last_line(publisher))
    time.sleep(SETTLE_S)  # What waits is taken, and the last chunk is written.
    used = [(cpu_ns(pid) - ns) / 1e3 / count for pid, ns in zip(pids, before, strict=True)]
    tell(publisher)
    heard = 0
    for process in (logger, bare):
        if process is not None:
            process.send_signal(signal.SIGINT)
    if bare is not None:
        heard = int(last_line(bare))
    for process in (logger, bare, publisher):
        if process is not None:
            process.wait(PATIENCE_S)
    recorded, each = read(bag / 'bag_0.mcap')
    return Trial(rate, count, reached, recorded, heard, used[0], used[1] if beside else 0.0, each)


def read(file: Path) -> tuple[int, float]:
    """Different poses of a finished file, and its bytes by message of any topic."""
    numbers = set()
    count = 0
    topics: dict[int, str] = {}
    with Salvage(file) as salvage:
        for record in salvage.records():
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message):
                count += 1
                if topics[record.channel_id] == f'/{TOPIC}':
                    numbers.add(bytes(record.data[STAMP_AT : STAMP_AT + 4]))
        assert salvage.whole, salvage.losses()
    return len(numbers), file.stat().st_size / max(1, count)


# -- all of them -----------------------------------------------------------------------------------
def half_width(values: list[float]) -> float:
    """Of the 95 % interval of the mean."""
    if len(values) < 2:
        return float('nan')
    return float(stats.t.ppf(0.975, len(values) - 1) * np.std(values, ddof=1) / np.sqrt(len(values)))


def with_interval(values: list[float], digits: int) -> str:
    return f'{np.mean(values):.{digits}f} +- {half_width(values):.{digits}f}'


def show(trials: list[Trial]) -> Table:
    """The figures as a table, one row a rate."""
    table = Table('poses a second', 'reached', 'lost of', 'logger, us a pose', 'bare, us a pose', 'ratio', 'bytes a message')
    for rate, beside in sorted({(trial.rate, trial.bare_us > 0) for trial in trials}, key=lambda key: (not key[1], key[0])):
        rows = [trial for trial in trials if trial.rate == rate and (trial.bare_us > 0) == beside]
        lost = sum(row.sent - row.recorded for row in rows)
        table.add_row(
            f'{rate:.0f}', f'{np.mean([row.reached_hz for row in rows]):.0f}', f'{lost} of {sum(row.sent for row in rows)}',
            with_interval([row.logger_us for row in rows], 1),
            with_interval([row.bare_us for row in rows], 1) if beside else '-',
            with_interval([row.logger_us / row.bare_us for row in rows], 2) if beside else '-',
            f'{np.mean([row.bytes_a_message for row in rows]):.1f}',
        )
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--rates', type=float, nargs='*', default=[100.0, 1000.0, 5000.0], help='beside a bare subscription')
    parser.add_argument('--alone', type=float, nargs='*', default=[10_000.0, 20_000.0], help='without one')
    parser.add_argument('--seconds', type=float, default=10.0)
    parser.add_argument('--runs', type=int, default=3)
    parser.add_argument('--json', type=Path, default=None, help='write the figures here too')
    parser.add_argument('--role', choices=('publish', 'listen'), help=argparse.SUPPRESS)
    parser.add_argument('--count', type=int, default=0, help=argparse.SUPPRESS)
    parser.add_argument('--readers', type=int, default=1, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.role == 'publish':
        publish(given.rates[0], given.count, given.readers)
    elif given.role == 'listen':
        listen()
    else:
        measure(given)


def measure(given: argparse.Namespace) -> None:
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    trials = []
    for _ in range(given.runs):
        for rate, beside in [*((rate, True) for rate in given.rates), *((rate, False) for rate in given.alone)]:
            with tempfile.TemporaryDirectory() as folder:
                trials.append(trial(rate, given.seconds, beside=beside, folder=Path(folder)))
            print(trials[-1], file=sys.stderr, flush=True)
    Console().print(show(trials))
    if given.json:
        given.json.write_text(json.dumps([asdict(entry) for entry in trials], indent=1))


if __name__ == '__main__':
    main()
