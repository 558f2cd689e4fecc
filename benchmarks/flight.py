"""What flying costs: latency and jitter of commands, alone and beside a learner that solves, and processor time of the graph.

    ./advise python benchmarks/flight.py [--seconds 20] [--json FILE]

Latency: a source publishes poses and receives the commands of the policy node that carry their stamps, at 20 Hz and
1 kHz; then again while a learner solves one problem after the other in a process beside it. Jitter: how far the
intervals between commands are from 50 ms, at 20 Hz. Processor time: the graph of the demo at real-time speed
learns from model demonstrations, stands for --seconds, and flies the route once.

Targets: latency p99 below 10 ms and jitter p99 below 5 ms beside the learner, the idle graph below 15 % of a core.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from advise_msgs.msg import LearnerStatus
from advise_ros.core.people.trial import fly
from advise_ros.demo.graph import DemoGraph
from advise_ros.demo.options import DemoOptions, share
from advise_ros.demo.trials import trial_settings
from advise_ros.recording.demofile import save_demonstrations
from advise_ros.recording.gridfile import load_grid
from advise_ros.ros.graph_client import GraphClient
from advise_ros.supervisor import Supervisor

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

from support.command_timing import Timing, command_timings

TICKS_PER_S = os.sysconf('SC_CLK_TCK')
PATIENCE_S = 120.0


def cpu_s(pid: int) -> float:
    """Processor seconds that a process has used."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


def usage(pids: dict[str, int], during_s: float) -> dict[str, float]:
    """Percent of one core by process, over some seconds."""
    before = {name: cpu_s(pid) for name, pid in pids.items()}
    time.sleep(during_s)
    return {name: 100.0 * (cpu_s(pid) - before[name]) / during_s for name, pid in pids.items()}


def measure(options: DemoOptions, seconds: float) -> dict[str, object]:
    """Start the graph, measure it idle and flying."""
    grid = load_grid(options.grid_file)
    with Supervisor(options.out / 'logs') as supervisor:
        client = GraphClient('benchmark', supervisor.check)
        graph = DemoGraph(options, grid, supervisor)
        graph.start_vehicle()
        graph.start_recording(options.out / 'bag')
        demonstrations = options.out / 'demonstrations.json'
        save_demonstrations(demonstrations, fly(grid, trial_settings(options), np.random.default_rng(options.seed)))
        graph.start_learning(options.seed, demonstrations)
        expert = graph.start_expert(options.seed)
        client.wait('the last answer', lambda: client.learner and client.learner.phase == LearnerStatus.DONE, PATIENCE_S)
        supervisor.stop(expert)
        client.wait('the vehicle to be ready', lambda: client.vehicle and client.vehicle.ready, PATIENCE_S)
        pids = supervisor.pids()
        idle = usage(pids, seconds)
        client.take_off(PATIENCE_S)
        started, before = time.monotonic(), {name: cpu_s(pid) for name, pid in pids.items()}
        result = client.fly(grid.waypoints[-1], PATIENCE_S)
        flown_s = time.monotonic() - started
        flying = {name: 100.0 * (cpu_s(pid) - before[name]) / flown_s for name, pid in pids.items()}
        client.close()
    return {'idle_percent': idle, 'flying_percent': flying, 'flight_reached_the_end': bool(result.success)}


def timing_table(timings: list[Timing]) -> Table:
    """Latency and jitter as a table."""
    table = Table('poses', 'beside it', 'commands', 'lost, %', 'latency p50, ms', 'p99', 'jitter p99, ms')
    for one in timings:
        beside = 'a learner that solves' if one.solving else 'nothing'
        jitter = f'{one.jitter_p99_ms:.2f}' if one.jitter_p99_ms else ''
        table.add_row(
            f'{one.rate_hz:g} Hz', beside, str(one.commands), f'{one.lost_percent:.2f}', f'{one.latency_p50_ms:.2f}',
            f'{one.latency_p99_ms:.2f}', jitter,
        )
    return table


def show(found: dict[str, object]) -> Table:
    """The figures as a table."""
    idle, flying = found['idle_percent'], found['flying_percent']
    assert isinstance(idle, dict)
    assert isinstance(flying, dict)
    table = Table('process', 'idle, % of a core', 'flying, % of a core')
    for name in idle:
        table.add_row(name, f'{idle[name]:.1f}', f'{flying[name]:.1f}')
    table.add_row('together', f'{sum(idle.values()):.1f}', f'{sum(flying.values()):.1f}')
    without = sum(value for name, value in idle.items() if name != 'simulator')
    table.add_row('together, without the simulator', f'{without:.1f}', '')
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=20.0, help='how long the idle graph is watched')
    parser.add_argument('--json', type=Path, default=None, help='write the figures here too')
    given = parser.parse_args()
    timings = command_timings(given.seconds)
    Console().print(timing_table(timings))
    with tempfile.TemporaryDirectory() as directory:
        options = DemoOptions(
            'simulated', 0, 4, 6, 2, 1.0, share('grid_demo.yaml'), share('demo.yaml'), Path(directory),
        )
        found = measure(options, given.seconds)
    Console().print(show(found))
    found['latency'] = [timing._asdict() for timing in timings]
    if given.json is not None:
        given.json.write_text(json.dumps(found, indent=1) + '\n')


if __name__ == '__main__':
    main()
