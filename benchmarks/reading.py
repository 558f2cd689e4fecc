"""Reading recordings: seconds from a bag or an autopilot's log to poses and to demonstrations, beside other parsers.

usage: ./advise python benchmarks/reading.py [--poses 1000000] [--trials 5] [--commands] [--logs [N]]

Makes a bag of simulated flights along config/grid_6x6.yaml in a temporary directory and reads it in each way in turn;
prints Markdown: the median of the trials with their range, and ratios within this run. Memory is the peak of what
Python and numpy allocated, without what is handed back (32 bytes a pose). --logs: a .BIN and a .ulg of N of these
positions (default: all), beside what pymavlink and pyulog need to parse them and nothing more; read once each.
"""

from __future__ import annotations

import argparse
import statistics
import struct
import sys
import tempfile
import time
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import zstandard
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from pymavlink import DFReader
from pyulog import ULog
from rosbags.highlevel import AnyReader

from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of
from advise_ros.core.demonstrations.samples import CommandSamples, PoseSamples, Recording, VehicleEvent
from advise_ros.core.grid.grid import Grid
from advise_ros.recording.bags import read_bag
from advise_ros.recording.definitions import definition
from advise_ros.recording.gridfile import load_grid
from advise_ros.recording.sources import read_recording
from advise_ros.recording.writer import BagWriter

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

from support.logs import dataflash, ulog

GRID_FILE = Path(__file__).parents[1] / 'config' / 'grid_6x6.yaml'
RATE_HZ, SPEED_M_S, NS = 20.0, 1.2, 1_000_000_000
HEAD = struct.Struct('<HHiII4s')


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--poses', type=int, default=1_000_000)
    parser.add_argument('--trials', type=int, default=5)
    parser.add_argument('--commands', action='store_true', help='a velocity command after each pose')
    parser.add_argument('--logs', type=int, nargs='?', const=0, help="autopilots' logs of so many positions, and no bag")
    options = parser.parse_args()
    grid = load_grid(GRID_FILE)
    if options.logs is not None:
        report_logs(grid, options.logs or options.poses)
        return
    with tempfile.TemporaryDirectory() as directory:
        bag = make(Path(directory) / 'bag', grid, options.poses, commands=options.commands)
        report(bag, grid, options)


def report(bag: Path, grid: Grid, options: argparse.Namespace) -> None:
    ways: dict[str, Callable[[], object]] = {
        'plain scan: every chunk uncompressed and its checksum compared': lambda: scan(bag),
        'poses as arrays': lambda: read_bag(bag),
        'demonstrations': lambda: demonstrations(bag, grid),
        'rosbags, each pose deserialised': lambda: by_rosbags(bag),
    }
    seconds: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(options.trials):
        for name, way in ways.items():
            begin_s = time.perf_counter()
            way()
            seconds[name].append(time.perf_counter() - begin_s)
    plain_s, *_, rosbags_s = (statistics.median(found) for found in seconds.values())
    (file,) = bag.glob('*.mcap')
    print(f'{options.poses} poses, {len(demonstrations(bag, grid))} flights, {file.stat().st_size / 1e6:.0f} MB, '
          f'{options.trials} trials\n')
    print('| what | s | range | times a plain scan | times faster than rosbags |\n| --- | --- | --- | --- | --- |')
    for name, found in seconds.items():
        median_s = statistics.median(found)
        print(f'| {name} | {median_s:.2f} | {min(found):.2f} to {max(found):.2f} | {median_s / plain_s:.2f} '
              f'| {rosbags_s / median_s:.1f} |')
    print(f'\nmemory beside the arrays that are handed back: {memory_mb(bag):.1f} MB')


def report_logs(grid: Grid, n_poses: int) -> None:
    """From autopilots' logs to demonstrations, beside their own parsers."""
    flown = recording(grid, n_poses)
    print(f'{n_poses} positions, and as many commands\n')
    print('| log | MB | demonstrations, s | parser alone, s | share |\n| --- | --- | --- | --- | --- |')
    with tempfile.TemporaryDirectory() as directory:
        for name, data_of, parse in (('flight.BIN', dataflash, by_pymavlink), ('flight.ulg', ulog, by_pyulog)):
            path = Path(directory) / name
            path.write_bytes(data_of(flown))
            ours_s, found = timed(lambda path=path: demonstrations_of(grid, read_recording(path), DiscretiseSettings()))
            theirs_s, count = timed(lambda path=path, parse=parse: parse(path))
            if count != n_poses or not found.demonstrations:
                raise SystemExit(f'{name}: {count} positions by its parser, {len(found.demonstrations)} demonstrations')
            size_mb = path.stat().st_size / 1e6
            print(f'| {path.suffix} | {size_mb:.0f} | {ours_s:.2f} | {theirs_s:.2f} | {ours_s / theirs_s:.2f} |')


def recording(grid: Grid, n_poses: int) -> Recording:
    """The flights as samples, with a command after each position."""
    positions = flights(grid, n_poses)
    stamps_ns = (1000 * NS + np.arange(n_poses) * NS / RATE_HZ).astype(np.int64)
    commands = CommandSamples(stamps_ns, np.diff(positions, axis=0, append=positions[-1:]) * RATE_HZ)
    armed = VehicleEvent(int(stamps_ns[0]), True, None, 'GUIDED', 'ardupilot')
    return Recording(PoseSamples(stamps_ns, positions), commands, (armed,))


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    begin_s = time.perf_counter()
    found = work()
    return time.perf_counter() - begin_s, found


def by_pymavlink(path: Path) -> int:
    """Positions in a .BIN."""
    reader = DFReader.DFReader_binary(str(path))
    count = 0
    while (message := reader.recv_match(type=['XKF1', 'GUIP', 'MODE', 'ARM', 'EV'])) is not None:
        count += message.get_type() == 'XKF1'
    reader.close()
    return count


def by_pyulog(path: Path) -> int:
    """Positions in a .ulg."""
    return len(ULog(str(path)).get_dataset('vehicle_local_position').data['timestamp'])


def make(bag: Path, grid: Grid, n_poses: int, *, commands: bool) -> Path:
    """Round flights at 20 Hz, one after the other."""
    positions = flights(grid, n_poses)
    writer = BagWriter(bag)
    pose = writer.add_topic('/pose', definition('geometry_msgs/msg/PoseStamped'))
    command = writer.add_topic('/cmd_vel', definition('geometry_msgs/msg/TwistStamped')) if commands else None
    velocities = np.diff(positions, axis=0, append=positions[-1:]) * RATE_HZ
    for index, (position, velocity) in enumerate(zip(positions.tolist(), velocities.tolist(), strict=True)):
        stamp_ns = 1_700_000_000 * NS + int(index * NS / RATE_HZ)
        head = HEAD.pack(0x0100, 0, stamp_ns // NS, stamp_ns % NS, 4, b'map')
        writer.write(pose, stamp_ns, stamp_ns, head + struct.pack('<7d', *position, 0.0, 0.0, 0.0, 1.0))
        if command is not None:
            writer.write(command, stamp_ns, stamp_ns, head + struct.pack('<6d', *velocity, 0.0, 0.0, 0.0))
    writer.close()
    return bag


def flights(grid: Grid, n_poses: int) -> np.ndarray:
    """(n, 3) positions: up, along the waypoints in cell-wise legs, down; with 2 cm of noise."""
    corners = [grid.xy(cell) for cell in (grid.waypoints[-1], *grid.waypoints)]
    points = [(*grid.centre_enu_m(grid.cell(*corners[0])), 0.0)]
    points += [(*grid.centre_enu_m(grid.cell(x, y)), grid.altitude_m) for x, y in corners]
    points += [(*points[-1][:2], 0.0)]
    legs = np.array(points)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(legs, axis=0), axis=1))])
    steps = np.arange(0.0, along[-1], SPEED_M_S / RATE_HZ)
    one = np.column_stack([np.interp(steps, along, legs[:, axis]) for axis in range(3)])
    many = np.tile(one, (n_poses // len(one) + 1, 1))[:n_poses]
    return many + np.random.default_rng(1).normal(0.0, 0.02, many.shape)


def scan(bag: Path) -> int:
    """Bytes in all chunks."""
    total = 0
    for file in bag.glob('*.mcap'):
        with file.open('rb') as stream:
            for record in StreamReader(stream, emit_chunks=True).records:
                if isinstance(record, Chunk):
                    data = zstandard.decompress(record.data, record.uncompressed_size)
                    assert zlib.crc32(data) == record.uncompressed_crc
                    total += len(data)
    return total


def demonstrations(bag: Path, grid: Grid) -> tuple[object, ...]:
    return demonstrations_of(grid, read_bag(bag), DiscretiseSettings()).demonstrations


def by_rosbags(bag: Path) -> list[tuple[int, float, float, float]]:
    found = []
    with AnyReader([bag]) as reader:
        wanted = [connection for connection in reader.connections if connection.topic == '/pose']
        for connection, _, raw in reader.messages(wanted):
            message = reader.deserialize(raw, connection.msgtype)
            stamp, at = message.header.stamp, message.pose.position
            found.append((stamp.sec * NS + stamp.nanosec, at.x, at.y, at.z))
    return found


def memory_mb(bag: Path) -> float:
    tracemalloc.start()
    recording = read_bag(bag)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    arrays = (*recording.poses, *recording.commands)
    return (peak - sum(array.nbytes for array in arrays)) / 1e6


if __name__ == '__main__':
    main()
