"""How soon and how evenly the policy node commands, alone and beside a learner that solves all the time."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.clock import Clock, ClockType

from advise_msgs.action import Fly
from advise_msgs.msg import Policy
from advise_ros.core.grid.grid import Grid
from advise_ros.core.learning.session import Session
from advise_ros.ros import qos
from advise_ros.ros.convert import stamp_to_ns
from support.graph import Graph
from support.learner import write_grid
from support.learning import BY_CLUSTERS
from support.policies import best, policy_message
from support.promises.rig import private_graph, square
from support.walks import everywhere

JITTER_RATE_HZ, LOAD_RATE_HZ = 20.0, 1000.0
# Discovery and first messages.
WARM_UP_S = 1.0


class Timing(NamedTuple):
    """Figures of one rate of poses; `lost_percent`: poses that no command was made from."""

    rate_hz: float
    solving: bool
    commands: int
    lost_percent: float
    latency_p50_ms: float
    latency_p99_ms: float
    jitter_p99_ms: float


class Source:
    """Publishes poses of a vehicle that hovers at the start, and receives the commands made from them."""

    def __init__(self, graph: Graph, rate_hz: float) -> None:
        self.sent: dict[int, float] = {}
        self.heard: list[tuple[int, float]] = []
        self._node = graph.node
        self._poses = self._node.create_publisher(PoseStamped, 'pose', qos.SENSOR)
        self._node.create_subscription(TwistStamped, 'cmd_vel', self._on_command, qos.COMMAND_DEEP)
        self._node.create_timer(1.0 / rate_hz, self._turn, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _turn(self) -> None:
        message = PoseStamped()
        message.header.frame_id = 'map'
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.pose.position.z, message.pose.orientation.w = 3.0, 1.0
        self.sent[stamp_to_ns(message.header.stamp)] = time.perf_counter()
        self._poses.publish(message)

    def _on_command(self, message: TwistStamped) -> None:
        self.heard.append((stamp_to_ns(message.header.stamp), time.perf_counter()))


def command_timings(seconds: float) -> list[Timing]:
    """Each rate, without and with a learner beside it."""
    found = []
    for solving in (False, True):
        for rate_hz in (JITTER_RATE_HZ, LOAD_RATE_HZ):
            with learner(solving):
                found.append(_timing(rate_hz, seconds, solving))
    return found


def _timing(rate_hz: float, seconds: float, solving: bool) -> Timing:
    grid = square()
    with tempfile.TemporaryDirectory() as folder, private_graph() as graph:
        source = Source(graph, rate_hz)
        graph.start('policy', {'grid_file': write_grid(Path(folder), grid)})
        graph.publisher('advise/policy', Policy, qos.latched()).publish(policy_message(grid, best(grid)))
        graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=-1))
        time.sleep(WARM_UP_S)
        from_s = time.perf_counter()
        time.sleep(seconds)
        until_s = time.perf_counter()
    sent = {stamp: at_s for stamp, at_s in source.sent.items() if from_s <= at_s < until_s}
    heard = [(at_s, at_s - sent[stamp]) for stamp, at_s in source.heard if stamp in sent]
    latencies = 1e3 * np.array([latency for _, latency in heard])
    intervals = 1e3 * np.diff([at_s for at_s, _ in heard])
    jitter = float(np.percentile(np.abs(intervals - 1e3 / rate_hz), 99)) if rate_hz == JITTER_RATE_HZ else 0.0
    lost = 100.0 * (1.0 - len(heard) / len(sent))
    return Timing(rate_hz, solving, len(heard), lost, *(float(np.percentile(latencies, p)) for p in (50, 99)), jitter)


@contextmanager
def learner(solving: bool) -> Iterator[None]:
    """A process that learns again and again, if wanted."""
    if not solving:
        yield
        return
    with subprocess.Popen([sys.executable, '-m', 'support.command_timing'], cwd=Path(__file__).parents[1]) as process:
        try:
            yield
            assert process.poll() is None, 'the learner has ended'
        finally:
            process.kill()


def solve_for_ever() -> None:
    """One policy after the other from the same demonstrations."""
    grid = Grid(2.0, 8, 8, (-1.0, -1.0), 3.0, waypoints=(7, 63, 56, 0))
    session = Session(grid, BY_CLUSTERS)
    session.add(everywhere(grid, 400))
    work = session.snapshot()
    assert work is not None
    while True:
        work.run()


if __name__ == '__main__':
    solve_for_ever()
