"""What each node takes of a small computer: its own memory, and how long from its start until it is at work.

    ./advise python benchmarks/footprint.py [--seconds 20] [--repeats 3] [--json FILE]

The graph of a session starts node by node, each when the one before is at work; then a vehicle in the simulator stands and
sends for --seconds. Memory is the proportional set size (PSS) of Linux: pages shared with others count by their part.
At work: the first status on /diagnostics that is not "starting", by the node's own clock; "seen": when another process received
one, which takes discovery by DDS as well; "processor": time of all its threads until it is seen, which is what the start takes
on a quiet core whatever else runs here. Beside it, in the same run, a bare rclpy node with one publisher, before all others and
after them. Figures are medians and the largest over the repeats.

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

from diagnostic_msgs.msg import DiagnosticStatus
from rich.console import Console
from rich.table import Table

from advise_ros.demo.options import free_udp_port, share
from advise_ros.ros.diagnostics import AT_WORK_AFTER, STARTING
from advise_ros.ros.graph_client import GraphClient
from advise_ros.ros.private_domain import private_domain
from advise_ros.supervisor import Supervisor

PATIENCE_S = 60.0
LEAST_MB = {'mavlink_bridge': 60.0, 'guard': 60.0, 'policy': 60.0, 'logger': 60.0, 'recorder': 80.0}
MOST_START_S = 1.5
# Their names, in the graph too.
FIRST_BARE, LAST_BARE = 'bare_first', 'bare_last'
BARE_NODE = """
import sys
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from advise_ros.ros.diagnostics import AT_WORK_AFTER, age_of_process_s
rclpy.init()
node = rclpy.create_node(sys.argv[1])
publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
after = KeyValue(key=AT_WORK_AFTER, value=f'{age_of_process_s():.2f}')
at_work = DiagnosticArray(status=[DiagnosticStatus(name=sys.argv[1], message='at work', values=[after])])
node.create_timer(0.1, lambda: publisher.publish(at_work))
rclpy.spin(node)
"""
# Kind of figure -> node -> one figure a repeat.
Figures = dict[str, dict[str, list[float]]]


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


def one_run(seconds: float, figures: Figures) -> None:
    """Start all, let them work, and add the figures."""
    with tempfile.TemporaryDirectory() as scratch, Supervisor(Path(scratch) / 'logs') as supervisor:
        client = GraphClient('footprint', supervisor.check)
        children = {}
        for name, parameters in {FIRST_BARE: None, **nodes(Path(scratch)), LAST_BARE: None}.items():
            began = time.monotonic()
            bare = [sys.executable, '-c', BARE_NODE, name]
            children[name] = supervisor.start(name, bare) if parameters is None else supervisor.start_node(name, parameters)
            said = client.wait(name, lambda node=name: at_work(client, node), PATIENCE_S)
            figures['seen_s'][name].append(time.monotonic() - began)
            figures['processor_s'][name].append(processor_s(children[name].process.pid))
            figures['at_work_s'][name].append(next(float(one.value) for one in said.values if one.key == AT_WORK_AFTER))
        time.sleep(seconds)
        for name, child in children.items():
            figures['memory_mb'][name].append(pss_mb(child.process.pid))
        client.close()


def at_work(client: GraphClient, node: str) -> DiagnosticStatus | None:
    said = client.health.get(node)
    return said if said is not None and said.message != STARTING else None


def table(figures: Figures) -> Table:
    """Medians, with the largest in brackets, and what is wanted."""
    shown = Table('node', 'memory, MB', 'wanted', 'at work, s', 'wanted', 'processor, s', 'seen, s')
    for name in figures['memory_mb']:
        def of(kind: str, digits: int, node: str = name) -> str:
            found = figures[kind][node]
            return f'{statistics.median(found):.{digits}f} ({max(found):.{digits}f})'

        memory = f'< {LEAST_MB[name]:g}' if name in LEAST_MB else ''
        start = '' if name in (FIRST_BARE, LAST_BARE) else f'< {MOST_START_S:g}'
        shown.add_row(name, of('memory_mb', 0), memory, of('at_work_s', 2), start, of('processor_s', 2), of('seen_s', 2))
    return shown


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=20.0, help='how long the graph works before its memory is read')
    parser.add_argument('--repeats', type=int, default=3)
    parser.add_argument('--json', type=Path, default=None, help='write the figures here too')
    given = parser.parse_args()
    figures: Figures = defaultdict(lambda: defaultdict(list))
    with private_domain() as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        for _ in range(given.repeats):
            one_run(given.seconds, figures)
    Console(width=100).print(table(figures))
    if given.json is not None:
        given.json.write_text(json.dumps(figures, indent=1) + '\n')


if __name__ == '__main__':
    main()
