"""The running graph: processor time of every node idle and flying, and the latency from pose to command.

    ./advise python benchmarks/graph.py [--seconds 20] [--json FILE]

Starts the graph of the demo at real-time speed as real processes, learns from model demonstrations with the
simulated expert, lets it stand for --seconds, and flies the route once. Latency is measured by a third
process: from hearing a pose to hearing the command that carries its stamp.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from pathlib import Path

import numpy as np
from geometry_msgs.msg import PoseStamped, TwistStamped
from rich.console import Console
from rich.table import Table

from advise_msgs.msg import LearnerStatus
from advise_ros.core.trial import fly
from advise_ros.demo.graph import DemoGraph
from advise_ros.demo.options import DemoOptions, share
from advise_ros.demo.supervisor import Supervisor
from advise_ros.demo.trials import trial_settings
from advise_ros.recording.demofile import save_demonstrations
from advise_ros.recording.gridfile import load_grid
from advise_ros.ros import qos
from advise_ros.ros.graph_client import GraphClient

TICKS_PER_S = os.sysconf('SC_CLK_TCK')
PATIENCE_S = 120.0


def cpu_s(pid: int) -> float:
    """Processor seconds that a process has used."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


class Latency:
    """Pairs poses with the commands that carry their stamps; receive times are steady."""

    def __init__(self, client: GraphClient) -> None:
        self._heard: dict[tuple[int, int], float] = {}
        self.seconds: list[float] = []
        client.on_pose = self._on_pose
        client.node.create_subscription(TwistStamped, 'cmd_vel', self._on_command, qos.COMMAND_DEEP)

    def _on_pose(self, pose: PoseStamped) -> None:
        self._heard[pose.header.stamp.sec, pose.header.stamp.nanosec] = time.perf_counter()

    def _on_command(self, command: TwistStamped) -> None:
        heard = self._heard.get((command.header.stamp.sec, command.header.stamp.nanosec))
        if heard is not None:
            self.seconds.append(max(0.0, time.perf_counter() - heard))


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
        latency = Latency(client)
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
    found = np.array(latency.seconds) * 1e3
    return {
        'idle_percent': idle, 'flying_percent': flying, 'flight_reached_the_end': bool(result.success),
        'commands': len(found),
        'latency_p50_ms': float(np.percentile(found, 50)), 'latency_p99_ms': float(np.percentile(found, 99)),
    }


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
    with tempfile.TemporaryDirectory() as directory:
        options = DemoOptions(
            'simulated', 0, 4, 6, 1, 2, 1.0, share('grid_demo.yaml'), share('demo.yaml'), Path(directory),
        )
        found = measure(options, given.seconds)
    Console().print(show(found))
    print(
        f'pose to command: p50 {found["latency_p50_ms"]:.2f} ms, p99 {found["latency_p99_ms"]:.2f} ms '
        f'over {found["commands"]} commands of one flight',
    )
    if given.json is not None:
        given.json.write_text(json.dumps(found, indent=1) + '\n')


if __name__ == '__main__':
    main()
