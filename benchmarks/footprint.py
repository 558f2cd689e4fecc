"""What each node takes of a small computer: its own memory, and how long from its start until it is at work.

    ./advise python benchmarks/footprint.py [--seconds 20] [--repeats 3] [--json FILE]

The graph of a session starts node by node, each when the one before is at work; then a vehicle in the simulator stands and
sends for --seconds. Memory is the proportional set size (PSS) of Linux: pages shared with others count by their part.
At work: the first entry on /diagnostics that is not "starting"; until then also the processor time of all its threads, which is
what the start takes on a quiet core whatever else runs here. Beside it, in the same run, a bare rclpy node with one
publisher, whose start ends with its first message. Figures are medians and the largest over the repeats.

Targets: bridge, guard, policy and logger below 60 MB, recorder below 80 MB, every node at work within 1.5 s.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

from rich.console import Console
from rich.table import Table

from advise_ros.demo.options import free_udp_port, share
from advise_ros.ros.graph_client import GraphClient
from advise_ros.ros.private_domain import private_domain
from advise_ros.supervisor import Supervisor

PATIENCE_S = 60.0
LEAST_MB = {'mavlink_bridge': 60.0, 'guard': 60.0, 'policy': 60.0, 'logger': 60.0, 'recorder': 80.0}
MOST_START_S = 1.5
BARE = 'bare rclpy node'
BARE_NODE = """
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
rclpy.init()
node = rclpy.create_node('bare')
publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
at_work = DiagnosticArray(status=[DiagnosticStatus(name='/bare', message='at work')])
node.create_timer(0.1, lambda: publisher.publish(at_work))
rclpy.spin(node)
"""


def pss_mb(pid: int) -> float:
    """Proportional set size of a process [MB]."""
    fields = dict(line.split(':', 1) for line in Path(f'/proc/{pid}/smaps_rollup').read_text().splitlines()[1:])
    return int(fields['Pss'].split()[0]) * 1024 / 1e6


def processor_s(pid: int) -> float:
    """Processor time of a process so far [s]."""
    after_name = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(after_name[11]) + int(after_name[12])) / os.sysconf('SC_CLK_TCK')


def nodes(folder: Path) -> dict[str, dict[str, object]]:
    """The nodes of a session with their parameters, in the order of their start."""
    port, grid = free_udp_port(), {'grid_file': share('grid_6x6.yaml')}
    return {
        'simulator': {'endpoint': f'udpout:127.0.0.1:{port}', 'ready_after_s': 1.0},
        'logger': {'bag': folder / 'bag'},
        'mavlink_bridge': {**grid, 'url': f'udpin:127.0.0.1:{port}'},
        'recorder': grid,
        'guard': grid,
        'policy': grid,
        'advise': grid,
        'console': {**grid, 'port': 0},
    }


def one_run(
    seconds: float, start_s: dict[str, list[float]], start_cpu_s: dict[str, list[float]], memory_mb: dict[str, list[float]],
) -> None:
    """Start all, let them work, and add the figures."""
    with tempfile.TemporaryDirectory() as scratch, Supervisor(Path(scratch) / 'logs') as supervisor:
        client = GraphClient('footprint', supervisor.check)
        began = time.monotonic()
        children = {BARE: supervisor.start('bare', [sys.executable, '-c', BARE_NODE])}
        client.wait('the bare node', lambda: client.health.get('bare'), PATIENCE_S)
        start_s[BARE].append(time.monotonic() - began)
        start_cpu_s[BARE].append(processor_s(children[BARE].process.pid))
        for name, parameters in nodes(Path(scratch)).items():
            began = time.monotonic()
            children[name] = supervisor.start_node(name, parameters)
            client.wait(name, lambda node=name: is_at_work(client, node), PATIENCE_S)
            start_s[name].append(time.monotonic() - began)
            start_cpu_s[name].append(processor_s(children[name].process.pid))
        time.sleep(seconds)
        for name, child in children.items():
            memory_mb[name].append(pss_mb(child.process.pid))
        client.close()


def is_at_work(client: GraphClient, node: str) -> bool:
    said = client.health.get(node)
    return said is not None and said.message != 'starting'


def table(start_s: dict[str, list[float]], start_cpu_s: dict[str, list[float]], memory_mb: dict[str, list[float]]) -> Table:
    """Medians with the largest, and whether the targets hold."""
    shown = Table('node', 'memory, MB', 'largest', 'wanted', 'at work after, s', 'longest', 'wanted', 'processor, s')
    for name, taken_mb in memory_mb.items():
        wanted = f'< {LEAST_MB[name]:g}' if name in LEAST_MB else ''
        shown.add_row(
            name, f'{statistics.median(taken_mb):.0f}', f'{max(taken_mb):.0f}', wanted,
            f'{statistics.median(start_s[name]):.2f}', f'{max(start_s[name]):.2f}', '' if name == BARE else f'< {MOST_START_S:g}',
            f'{statistics.median(start_cpu_s[name]):.2f}',
        )
    return shown


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=20.0, help='how long the graph works before its memory is read')
    parser.add_argument('--repeats', type=int, default=3)
    parser.add_argument('--json', type=Path, default=None, help='write the figures here too')
    given = parser.parse_args()
    start_s: dict[str, list[float]] = defaultdict(list)
    start_cpu_s: dict[str, list[float]] = defaultdict(list)
    memory_mb: dict[str, list[float]] = defaultdict(list)
    with private_domain() as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        for _ in range(given.repeats):
            one_run(given.seconds, start_s, start_cpu_s, memory_mb)
    Console().print(table(start_s, start_cpu_s, memory_mb))
    if given.json is not None:
        figures = {'start_s': start_s, 'start_cpu_s': start_cpu_s, 'memory_mb': memory_mb}
        given.json.write_text(json.dumps(figures, indent=1) + '\n')


if __name__ == '__main__':
    main()
